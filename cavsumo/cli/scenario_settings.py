"""The words of a command line as the settings of a scenario, or of several."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cavsumo.errors import InputError
from cavsumo.model.named_networks import DEFAULT

if TYPE_CHECKING:
    from cavsumo.model.study import Part

# Settings that the command line takes over as they are.
PLAIN = (
    "net routes traffic ego junction signal agents runs seed end step_length testers kind jaywalk "
    "approaches "
    "bodies_per_agent embodiment sumo_width start_speed trace assertions "
    "reference reset shard first until_tests until_half_width until_rate"
).split()


def parts_of(options: argparse.Namespace) -> list[Part]:
    """The batches of a run: the file's, overruled by the command line."""
    from cavsumo.model.study import Part, read_study

    given = settings_of(options)
    if options.config:  # which says where it plays
        return read_study(Path(options.config), given)
    return [Part("", given, {"net": DEFAULT})]


def settings_of(options: argparse.Namespace) -> dict[str, Any]:
    """The settings that a command line gives."""
    given = {key: getattr(options, key) for key in PLAIN}
    given["deadline_s"], given["budget_s"] = options.deadline, options.budget
    if options.ego_route is not None:
        given["ego_route"] = options.ego_route.replace(",", " ").split()
        if not given["ego_route"]:
            raise InputError(f"--ego-route: expected edges, got {options.ego_route!r}")
    given["additional"] = options.additional_files and options.additional_files.split(",")
    settings = {key: value for key, value in given.items() if value is not None}
    if options.formula:
        settings["formulas"] = dict(_formula(word) for word in options.formula)
        if named := settings.get("assertions"):  # who writes a formula here means it
            settings["assertions"] = list(dict.fromkeys([*named, *settings["formulas"]]))
    for key, words in (
        ("params", options.param),
        ("ego_params", options.ego_param),
        ("assertion_params", options.assert_param),
        ("ego_sensor", options.ego_sensor),
        ("tester_sensor", options.tester_sensor),
    ):
        if words:
            settings[key] = dict(assignment(key, w) for w in words)
    return settings


def _formula(word: str) -> tuple[str, str]:
    """NAME=TEXT as two."""
    name, equals, text = word.partition("=")
    if not (equals and text.strip()):
        raise InputError(f"--formula: expected NAME=TEXT, got {word!r}")
    return name.strip(), text.strip()


def assignment(option: str, word: str) -> tuple[str, bool | int | float | str]:
    """KEY=VALUE as a key and a truth value, a number or a word."""
    key, equals, value = word.partition("=")
    if not (key and equals):
        raise InputError(f"{option}: expected KEY=VALUE, got {word!r}")
    if value in ("true", "false"):
        return key, value == "true"
    for number in (int, float):
        try:
            return key, number(value)
        except ValueError:
            continue
    return key, value
