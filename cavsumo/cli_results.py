"""Words into calls: the commands about results; the heavy parts are imported inside them."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any


def add_replay(commands: Any) -> None:
    """The command replay."""
    replay = commands.add_parser(
        "replay",
        help="run one recorded episode again and check, step by step, that it is the same",
        description="Run one recorded episode again and check, step by step, that it is the same.",
        allow_abbrev=False,
    )
    replay.add_argument("results", type=Path, help="the CSV of a batch")
    replay.add_argument("run", type=int, help="number of the episode")
    replay.set_defaults(command=_replay)


def add_report(commands: Any) -> None:
    """The command report."""
    report = commands.add_parser(
        "report",
        help="summarise results: rates with intervals, comparisons, times, what is distinct",
        description="Summarise results: rates with intervals, agents compared on the same seeds, "
        "time to the test, what it cost, how many tests and failures are distinct. Several results "
        "files are told together where their scenarios agree.",
        allow_abbrev=False,
    )
    add = report.add_argument
    add("results", nargs="+", type=Path, metavar="RESULTS", help="the CSV of a batch")
    add(
        "--by",
        default="agent",
        metavar="COLUMN",
        help="tell and compare the values of a column of the results apart, for each agent: ego, "
        "testers, ...; or file, or net",
    )
    add(
        "--format",
        choices=("table", "csv", "json", "markdown"),
        default="table",
        help="default table; csv and json hold all figures in full precision",
    )
    add("-o", "--output", type=Path, metavar="FILE", help="write it there instead of printing it")
    add("--junit", type=Path, metavar="FILE", help="also write JUnit XML")
    report.set_defaults(command=_report)


def add_merge(commands: Any) -> None:
    """The command merge."""
    merge = commands.add_parser(
        "merge",
        help="put the results of shards together",
        description="Put the results of shards together: the same file as one run would give.",
        allow_abbrev=False,
    )
    merge.add_argument("parts", nargs="+", type=Path, metavar="PART", help="the CSV of a shard")
    merge.add_argument("-o", "--output", required=True, type=Path, metavar="FILE")
    merge.add_argument("--overwrite", action="store_true", help="in place of an unfinished batch")
    merge.add_argument("-q", "--quiet", action="store_true", help="no summary")
    merge.set_defaults(command=_merge)


def _replay(options: argparse.Namespace) -> int:
    from cavsumo.commands.replay import replay

    return replay(options.results, options.run)


def _report(options: argparse.Namespace) -> int:
    from cavsumo.commands.report import report

    return report(options.results, options.by, options.format, options.output, options.junit)


def _merge(options: argparse.Namespace) -> int:
    from cavsumo.commands.merge import merge

    return merge(options.parts, options.output, options.overwrite, options.quiet)
