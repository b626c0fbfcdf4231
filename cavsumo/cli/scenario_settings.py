"""The words of a command line as the settings of a scenario, or of several."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cavsumo.cli.setting_options import given
from cavsumo.model.named_networks import DEFAULT
from cavsumo.model.scenario.fields import settings
from cavsumo.model.study import Part, read_study


def parts_of(options: argparse.Namespace) -> list[Part]:
    """The batches of a run: the file's, overruled by the command line."""
    found = settings_of(options)
    if options.config:  # which says where it plays
        return read_study(Path(options.config), found)
    return [Part("", found, {"net": DEFAULT})]


def settings_of(options: argparse.Namespace) -> dict[str, Any]:
    """The settings that a command line gives."""
    found = given(options, settings())
    if (formulas := found.get("formulas")) and (named := found.get("assertions")):
        # Who writes a formula on the command line means it.
        found["assertions"] = list(dict.fromkeys([*named, *formulas]))
    return found
