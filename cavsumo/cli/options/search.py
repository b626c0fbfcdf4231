"""Options of the command search: those of run, and how points are chosen."""

from __future__ import annotations

import argparse
import dataclasses
from typing import TYPE_CHECKING, Any

from cavsumo.agents.names import SEARCH, SEARCH_METHODS
from cavsumo.cli.options.run import fill, played

if TYPE_CHECKING:
    from cavsumo.model.study import Part

DEFAULTS = {"agents": [SEARCH], "testers": 1}


def add_search(commands: Any) -> None:
    """The command search."""
    search = commands.add_parser(
        "search",
        help="search for preventable failures of an ego",
        description="Search for preventable failures of an ego: every episode is a point of a "
        "space of tests, chosen from what came of those before. All options of run, with other "
        f"defaults: agent {SEARCH}, one tester.",
        allow_abbrev=False,
    )
    search.fill = _fill
    search.set_defaults(command=_search)


def _fill(search: argparse.ArgumentParser) -> None:
    """Add the options."""
    search.add_argument(
        "--method", metavar="NAME",
        help=f"how points are chosen: {', '.join(SEARCH_METHODS)} (default {SEARCH_METHODS[0]})",
    )  # fmt: skip
    fill(search)


def _search(options: argparse.Namespace) -> int:
    from cavsumo.cli.scenario_settings import parts_of

    parts = [_searching(part, options.method) for part in parts_of(options)]
    return played(parts, options)


def _searching(part: Part, method: str | None) -> Part:
    """A part that searches, unless it names its agents."""
    chosen = {f"{SEARCH}.method": method} if method else {}
    settings = dict(part.settings)
    if chosen:
        settings["params"] = {**(settings.get("params") or {}), **chosen}
    return dataclasses.replace(part, settings=settings, defaults={**part.defaults, **DEFAULTS})
