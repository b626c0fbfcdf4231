"""The options of a command line as the settings of one scenario or several."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cavsumo.cli.setting_options import given, named_text
from cavsumo.errors import InputError
from cavsumo.model.named_networks import DEFAULT
from cavsumo.model.scenario.fields import settings
from cavsumo.model.study import Part, at_each, read_study

if TYPE_CHECKING:
    from cavsumo.openscenario.parts import ScenarioParts

ROOT = "--scenario-root"


def parts_of(options: argparse.Namespace) -> list[Part]:
    """The batches of a run: those of the file, overridden by the command line."""
    found = settings_of(options)
    if options.config:  # which says where it plays
        parts = read_study(Path(options.config), found)
    else:
        parts = [Part("", found, {"net": DEFAULT})]
    nets = options.net or []
    return at_each(parts, nets) if len(nets) > 1 else parts


def published(options: argparse.Namespace) -> ScenarioParts | None:
    """The batches of a published scenario that a command line names; None for none."""
    others = [
        word
        for key, word in (
            ("scenario_param", "--scenario-param"),
            ("scenario_root", ROOT),
            ("scenario_ego", "--scenario-ego"),
        )
        if getattr(options, key) is not None
    ]
    if options.scenario is None:
        if others:
            raise InputError(f"{others[0]}: needs --scenario FILE")
        return None
    if options.config:
        raise InputError("--config: --scenario names another scenario; give one of them")
    from cavsumo.openscenario.parts import ScenarioChoice, scenario_parts

    root = options.scenario_root
    choice = ScenarioChoice(
        Path(options.scenario),
        dict(named_text("--scenario-param", word) for word in options.scenario_param or ()),
        None if root is None else Path(root),
        options.scenario_ego or "Ego",
    )
    return scenario_parts(choice, settings_of(options))


def settings_of(options: argparse.Namespace) -> dict[str, Any]:
    """The settings that a command line gives, with the first of several networks."""
    found = given(options, settings())
    if "net" in found:
        found["net"] = found["net"][0]
    if (formulas := found.get("formulas")) and (named := found.get("assertions")):
        # Who writes a formula on the command line means it.
        found["assertions"] = list(dict.fromkeys([*named, *formulas]))
    return found
