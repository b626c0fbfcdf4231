"""A suite as a batch to plan: its settings under those of the user."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from cavsumo.errors import InputError, UnknownName
from cavsumo.model.documents import first_problem
from cavsumo.model.scenario.suite import SuiteChoice
from cavsumo.model.study import Part
from cavsumo.suites.cases import SuiteCases
from cavsumo.suites.files import read_suite, suite_file
from cavsumo.suites.records import Suite


def suite_part(name: str, chosen: Mapping[str, Any], settings: Mapping[str, Any]) -> Part:
    """The batch of a suite.

    Args:
        name: of the suite, or its file.
        chosen: the selection, as the fields of ``SuiteChoice``.
        settings: the user's, which win over the suite's.

    Raises InputError for an unknown suite, test or speed, and for filters that leave nothing.
    """
    file = suite_file(name)
    suite = read_suite(file)
    try:
        choice = SuiteChoice(name=name, **chosen)
    except ValidationError as error:
        raise InputError(f"suite {name}: {first_problem(error)}") from error
    _check_values(suite, choice)
    cases = SuiteCases(suite, choice, file.parent, int(settings.get("seed", 1)))
    own = {"reference": "none", "assertions": ["collision"], **suite.settings}
    fixed = {
        "net": cases.nets()[0],
        "routes": "none",
        "suite": choice.model_dump(mode="json"),
        "runs": len(cases),
    }
    return Part("", {**own, **settings, **fixed})


def _check_values(suite: Suite, choice: SuiteChoice) -> None:
    """Refuse a number for a value that the suite does not have."""
    sizes = {f"{body}_{key}" for body in suite.bodies for key in ("length", "width", "front")}
    values = {name for test in suite.tests for name in test.values}
    for name, _ in choice.values:
        if name not in sizes | values | set(suite.values):
            valid = sizes | values | set(suite.values)
            raise UnknownName("value", name, valid, f"suite {choice.name}")
