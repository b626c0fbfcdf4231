"""Options of the command suite: which suite and which of its cases, and those of a batch."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cavsumo.cli.options.values import values_of
from cavsumo.errors import InputError

LIST = "list"
# Settings of a batch that a suite leaves to its user; all others are the suite's own.
KEYS = (
    "ego",
    "ego_params",
    "ego_sensor",
    "step_length",
    "assertions",
    "assertion_params",
    "reference",
    "seed",
    "trace",
    "deadline_s",
    "shard",
    "first",
    "budget_s",
)
# Defaults of a suite that are not those of a run.
OWN = {"step_length": "the suite's", "assertions": "collision", "reference": "none"}


def add_suite(commands: Any) -> None:
    """The command suite."""
    suite = commands.add_parser(
        "suite",
        help="play a published catalogue of tests",
        description="Play a published catalogue of tests: every case is one episode and one row, "
        f"with its name in the column case. '{LIST}' lists the suites, or the tests of one.",
        allow_abbrev=False,
    )
    suite.fill = _fill
    suite.set_defaults(command=_suite)


def _fill(suite: argparse.ArgumentParser) -> None:
    """Add the options."""
    from cavsumo.cli.options.run import OTHERS
    from cavsumo.cli.setting_options import add_setting, meaning
    from cavsumo.model.scenario.fields import settings

    suite.add_argument("name", help=f"a suite by name, a file of your own (.toml), or '{LIST}'")
    suite.add_argument("listed", nargs="?", metavar="NAME", help=f"after '{LIST}': its tests")
    cases = suite.add_argument_group("cases")
    cases.add_argument(
        "--only",
        action="append",
        metavar="TEST",
        help="a test or a case, such as CPNA or 'CPNA/30/*'; with commas, or repeat, for several",
    )
    cases.add_argument(
        "--speeds", metavar="KMH", help="speeds of the ego, with commas, such as 30,40"
    )
    cases.add_argument(
        "--extended", action="store_true", help="also the cells beyond the standard range"
    )
    cases.add_argument(
        "--vary",
        type=int,
        default=0,
        metavar="N",
        help="variations of each case besides itself, within the limits of the suite (default 0)",
    )
    cases.add_argument(
        "--set",
        action="append",
        type=_number,
        metavar="NAME=NUMBER",
        help="a number in place of a value of the suite or of the size of a body, such as "
        "ego_length=4.7 or adult_width=0.6; repeat for several",
    )
    offered = {setting.key: setting for setting in settings()}
    batch = suite.add_argument_group("batch")
    for key in KEYS:
        own = {"help": f"{meaning(offered[key])} (default: {OWN[key]})"} if key in OWN else {}
        add_setting(batch.add_argument, offered[key], **own)
    OTHERS["processes"](suite.add_argument_group("processes").add_argument)
    output = suite.add_argument_group("output")
    OTHERS["output"](output.add_argument)
    output.add_argument(
        "--html", type=Path, metavar="FILE", help="also write the grid of each test as a page"
    )


def _suite(options: argparse.Namespace) -> int:
    from cavsumo.batch.manner import Manner, Means
    from cavsumo.batch.planned import planned
    from cavsumo.cli.options.run import SCRATCH
    from cavsumo.cli.setting_options import given
    from cavsumo.model.scenario.fields import settings
    from cavsumo.suites.parts import suite_part

    if options.name == LIST:
        from cavsumo.suites.listing import listing

        print(listing(options.listed))
        return 0
    if options.listed is not None:
        raise InputError(f"suite: unexpected {options.listed!r} after {options.name!r}")
    manner = Manner(**values_of(options, Manner), scratch=options.output is None)
    means = Means(options.jobs, options.executor, options.scheduler)
    chosen = {
        "only": [word for text in options.only or () for word in text.split(",") if word],
        "speeds": speeds_of(options.speeds),
        "extended": options.extended,
        "vary": options.vary,
        "values": options.set or (),
    }
    known = [setting for setting in settings() if setting.key in KEYS]
    part = suite_part(options.name, chosen, given(options, known))
    batches = planned([part], Path(options.output or SCRATCH), manner)
    # What can be refused quickly has been; now comes what takes long to import.
    from cavsumo.cli.commands.suite import play_suite

    return play_suite(batches, means, manner, options.html)


def _number(word: str) -> tuple[str, float]:
    """NAME=NUMBER as two."""
    name, _, text = word.partition("=")
    try:
        return name, float(text)
    except ValueError:
        raise InputError(f"--set: expected NAME=NUMBER, got {word!r}") from None


def speeds_of(text: str | None) -> list[float]:
    """The numbers of ``30,40``; raises InputError for other words."""
    try:
        return [float(word) for word in (text or "").split(",") if word]
    except ValueError:
        raise InputError(f"--speeds: expected numbers with commas, got {text!r}") from None
