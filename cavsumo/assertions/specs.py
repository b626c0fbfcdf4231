"""Assertions by name: building them, and the files that define them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from cavsumo.assertions.base import ASSERTIONS, Assertion
from cavsumo.assertions.custom import CustomAssertion, custom_parameters
from cavsumo.assertions.formula import FormulaAssertion
from cavsumo.assertions.formulas import Rule, rule
from cavsumo.assertions.names import is_formula
from cavsumo.errors import InputError
from cavsumo.model.plugins import imported, source_file
from cavsumo.model.registry import Registry
from cavsumo.model.scenario import Scenario

# Forms of an assertion's name besides a registered name, for listings.
FORMS: Mapping[str, str] = {
    "module:function": "a Python function of each snapshot, below zero where it is violated; or a "
    "class (README)",
    "NAME=FORMULA": "temporal logic over named signals: --formula or [formulas] in the scenario "
    "file (docs/formulas.md)",
}


def assertions_of(scenario: Scenario) -> tuple[Assertion, ...]:
    """The assertions of a scenario; see ``make_assertions``."""
    return make_assertions(
        scenario.assertions, scenario.assertion_params, scenario.formulas, scenario.step_length
    )


def make_assertions(
    names: Iterable[str],
    params: Mapping[str, Any],
    formulas: Mapping[str, str],
    dt: float,
) -> tuple[Assertion, ...]:
    """The assertions of these names: formulas, the user's ``module:function``, registered ones.

    Parameters go to all that have them, or as ``NAME.KEY`` to one (``Registry.shared``). Raises
    InputError for a name given twice and for a formula that cannot be read, asserted or not.
    """
    names = tuple(names)
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"assertion {twice[0]!r} is named twice")
    known = registry_of(names, {name: rule(name, text, dt) for name, text in formulas.items()})
    chosen = known.shared(names, params)
    return tuple(known.make(name, chosen[name]) for name in names)


def registry_of(names: Iterable[str], rules: Mapping[str, Rule]) -> Registry[Assertion]:
    """All registered assertions, these formulas, and the user's own among the names."""
    known: Registry[Assertion] = Registry("assertion")
    for name in ASSERTIONS:
        known.register(name)(ASSERTIONS.get(name))
    for name, own in rules.items():
        if name in known:
            raise InputError(f"formula {name}: an assertion has that name already")
        known.register(name)(partial(FormulaAssertion, own))
    for name in names:
        if ":" in name and name not in known:
            known.register(name)(_custom(name))
        elif is_formula(name):
            raise InputError(
                f"assertion {name!r}: a formula is asserted by its name: --formula NAME='...'"
            )
    return known


def assertion_files(names: Iterable[str]) -> tuple[Path, ...]:
    """The files of the modules of the user's assertions."""
    custom = [name for name in names if ":" in name]
    for name in custom:
        custom_parameters(name)  # imports it
    return tuple(file for file in map(source_file, custom) if file is not None)


def _custom(spec: str) -> Any:
    """A user's assertion as a registry has it: called with keywords, its parameters known."""

    def make(**params: Any) -> Assertion:
        return CustomAssertion(spec, params)

    entry = imported(spec, f"assertion {spec}", "function or class", functions=True)
    make.__doc__ = entry.__doc__ or "An assertion of your own."
    make.__signature__ = custom_parameters(spec)  # type: ignore[attr-defined]
    make.PARAMETERS = getattr(entry, "PARAMETERS", {})  # type: ignore[attr-defined]
    return make
