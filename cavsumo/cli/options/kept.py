"""Options of minimise, keep and export; the heavy parts are imported when they are called."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cavsumo.cli.options.values import values_of


def add_minimise(commands: Any) -> None:
    """The command minimise."""
    minimise = commands.add_parser(
        "minimise",
        help="find the smallest test that still fails the ego the same way",
        description="Find the smallest test that still fails the ego the same way: fewer testers, "
        "less traffic, simpler motions, a shorter approach, rounder numbers. Each candidate is "
        "played: the same pair must violate the same assertion, and the reference driver must say "
        "the same of it.",
        allow_abbrev=False,
    )
    _add_episode(minimise)
    add = minimise.add_argument
    add("-o", "--output", type=Path, metavar="FILE", help="write the test as a file (.cavtest)")
    add("--html", type=Path, metavar="FILE", help="write before and after as one page")
    add(
        "--replays",
        type=int,
        default=1000,
        metavar="N",
        help="stop after so many replays, with the smallest test until then (default 1000)",
    )
    add("-q", "--quiet", action="store_true", help="no progress")
    minimise.set_defaults(command=_minimise)


def add_keep(commands: Any) -> None:
    """The command keep."""
    keep = commands.add_parser(
        "keep",
        help="write a recorded episode as one file that is played anywhere",
        description="Write a recorded episode as one file (.cavtest) that is played anywhere: its "
        "scenario, network and routes, starts, actions, traffic, verdict and page. It is played "
        "back before.",
        allow_abbrev=False,
    )
    _add_episode(keep)
    keep.add_argument(
        "-o", "--output", type=Path, required=True, metavar="FILE", help="the file (.cavtest)"
    )
    keep.set_defaults(command=_keep)


def add_export(commands: Any) -> None:
    """The command export."""
    export = commands.add_parser(
        "export",
        help="write a recorded episode in a format of others",
        description="Write a recorded episode in a format of others. openscenario: test.xosc "
        "(OpenSCENARIO XML 1.2) and test.xodr (OpenDRIVE 1.7) with the roads; commonroad: test.xml "
        "(CommonRoad 2020a) with lanelets, obstacles and the ego's planning problem.",
        allow_abbrev=False,
    )
    _add_episode(export)
    export.add_argument(
        "--to", required=True, choices=("openscenario", "commonroad"), help="the format"
    )
    export.add_argument(
        "--as",
        dest="way",
        choices=("recorded", "test"),
        default="recorded",
        help="recorded: all follow their recorded tracks (default); test: the ego is left to the "
        "player's controller, testers wait for it and then follow theirs",
    )
    export.add_argument(
        "-o", "--output", type=Path, required=True, metavar="FOLDER", help="a folder for the files"
    )
    export.set_defaults(command=_export)


def _add_episode(parser: argparse.ArgumentParser) -> None:
    """The options that name an episode."""
    add = parser.add_argument
    add(
        "results",
        type=Path,
        metavar="RESULTS",
        help="the CSV of a batch, a trace (.jsonl.gz), or a kept test (.cavtest)",
    )
    add("run", type=int, nargs="?", metavar="RUN", help="number of the episode in a CSV")
    add("-n", "--net", type=Path, metavar="NET", help="where the network is now, or its name")
    add("-r", "--routes", type=Path, metavar="FILE", help="where the routes are now")
    add(
        "--trust",
        action="store_true",
        help="play it even if its ego or an assertion, named in the file, is a command to run, a "
        "module to import or an address to connect to",
    )


def _minimise(options: argparse.Namespace) -> int:
    from cavsumo.cli.requests.kept import KeepOptions, check_kept

    wanted = KeepOptions(**values_of(options, KeepOptions))
    check_kept("minimise", wanted)
    from cavsumo.cli.commands.kept import minimise

    return minimise(wanted)


def _keep(options: argparse.Namespace) -> int:
    from cavsumo.cli.requests.kept import KeepOptions, check_kept

    wanted = KeepOptions(**values_of(options, KeepOptions))
    check_kept("keep", wanted)
    from cavsumo.cli.commands.kept import keep

    return keep(wanted)


def _export(options: argparse.Namespace) -> int:
    from cavsumo.cli.requests.kept import KeepOptions, check_export

    wanted = KeepOptions(**values_of(options, KeepOptions))
    check_export(wanted)
    from cavsumo.cli.commands.export import export

    return export(wanted)
