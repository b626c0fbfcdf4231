"""The options of a command line as the settings of one scenario or several."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cavsumo.cli.setting_options import given
from cavsumo.model.named_networks import DEFAULT
from cavsumo.model.scenario.fields import settings
from cavsumo.model.study import Part, at_each, read_study


def parts_of(options: argparse.Namespace) -> list[Part]:
    """The batches of a run: those of the file, overridden by the command line."""
    found = settings_of(options)
    if options.config:  # which says where it plays
        parts = read_study(Path(options.config), found)
    else:
        parts = [Part("", found, {"net": DEFAULT})]
    nets = options.net or []
    return at_each(parts, nets) if len(nets) > 1 else parts


def settings_of(options: argparse.Namespace) -> dict[str, Any]:
    """The settings that a command line gives, with the first of several networks."""
    found = given(options, settings())
    if "net" in found:
        found["net"] = found["net"][0]
    if (formulas := found.get("formulas")) and (named := found.get("assertions")):
        # Who writes a formula on the command line means it.
        found["assertions"] = list(dict.fromkeys([*named, *formulas]))
    return found
