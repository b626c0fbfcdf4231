"""Options of regress; the heavy parts are imported when it is called."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cavsumo.cli.options.values import values_of


def add_regress(commands: Any) -> None:
    """The command regress."""
    regress = commands.add_parser(
        "regress",
        help="play kept tests against another ego: which still fail it?",
        description="Play kept tests against another ego, and say of each whether it still fails, "
        "passes now, or no longer meets the ego. Exit status 0: none fails; 1: one still fails, or "
        "the ego stands still; 2: a file or the ego is wrong; 3: one could not be played.",
        allow_abbrev=False,
    )
    add = regress.add_argument
    add("tests", nargs="+", type=Path, metavar="FILE", help="a kept test (.cavtest)")
    add("--ego", required=True, metavar="NAME", help="the ego, as for run --ego")
    add(
        "--ego-param",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="a parameter of the ego",
    )
    add(
        "--testers",
        choices=("recorded", "policy"),
        default="recorded",
        help="recorded (default): testers do what was recorded, by the clock; policy: each sets "
        "off when the ego is where it was as the tester last stood",
    )
    add("--junit", type=Path, metavar="FILE", help="also write JUnit XML")
    add("-j", "--jobs", type=int, default=1, metavar="N", help="tests at a time (default 1)")
    add(
        "--strict",
        action="store_true",
        help="a test that no longer meets the ego fails, too",
    )
    add(
        "--trust",
        action="store_true",
        help="use assertions that only the files name, which are modules to import",
    )
    add("-q", "--quiet", action="store_true", help="no progress, and print the last line only")
    regress.set_defaults(command=_regress)


def _regress(options: argparse.Namespace) -> int:
    from cavsumo.cli.requests.regress import RegressOptions, check_regress
    from cavsumo.model.checks import assignment

    given = values_of(options, RegressOptions)
    given["ego_param"] = dict(assignment("--ego-param", word) for word in options.ego_param)
    wanted = RegressOptions(**given)
    check_regress(wanted)
    from cavsumo.cli.commands.regress import regress

    return regress(wanted)
