"""Options of replay, report and merge; the heavy parts are imported when they are called."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cavsumo.cli.options.values import values_of


def add_replay(commands: Any) -> None:
    """The command replay."""
    replay = commands.add_parser(
        "replay",
        help="run one recorded episode again and check, step by step, that it is the same",
        description="Run one recorded episode again and check, step by step, that it is the same; "
        "then show it, if wanted. A trace can be replayed from its file alone: the network is "
        "looked for where it was and beside the trace.",
        allow_abbrev=False,
    )
    add = replay.add_argument
    add(
        "results",
        type=Path,
        help="the CSV of a batch, a trace (.jsonl.gz or .jsonl), or a kept test (.cavtest)",
    )
    add("run", type=int, nargs="?", help="number of the episode, if that is a CSV")
    add("--html", type=Path, metavar="FILE", help="write it as one page that any browser plays")
    add("--fcd", type=Path, metavar="FILE", help="write it as SUMO's floating car data")
    add("--gui", action="store_true", help="show it in sumo-gui (pip install 'cavsumo[osm]')")
    add("--delay", type=float, metavar="MS", help="of --gui: how long a timestep is shown")
    add(
        "--recorded",
        action="store_true",
        help="show what was recorded, without running it again: with other versions, say",
    )
    add(
        "--playback",
        action="store_true",
        help="play its recorded actions and traffic back instead of asking its agent: from its "
        "trace and the network, without routes",
    )
    add(
        "--trust",
        action="store_true",
        help="play it even if its ego or an assertion, named in the file, is a command to run, a "
        "module to import or an address to connect to; not needed with --recorded",
    )
    add("-n", "--net", type=Path, metavar="NET", help="where the network is now, or its name")
    add("-r", "--routes", type=Path, metavar="FILE", help="where the routes are now")
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
    add("--html", type=Path, metavar="FILE", help="also write it as one page for the browser")
    add(
        "--replays",
        type=int,
        default=20,
        metavar="N",
        help="of --html: so many failures, and half as many passed tests, as pages that play "
        "them, in a folder beside it (default 20)",
    )
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
    merge.add_argument("--overwrite", action="store_true", help="in place of what is there")
    merge.add_argument("-q", "--quiet", action="store_true", help="no summary")
    merge.set_defaults(command=_merge)


def _replay(options: argparse.Namespace) -> int:
    from cavsumo.cli.requests.replay import ReplayOptions, check_replay

    wanted = ReplayOptions(**values_of(options, ReplayOptions))
    check_replay(options.results, wanted)
    from cavsumo.cli.commands.replay import replay

    return replay(options.results, wanted)


def _report(options: argparse.Namespace) -> int:
    from cavsumo.report.order import ReportOptions, check_report

    wanted = ReportOptions(**values_of(options, ReportOptions))
    check_report(options.results, wanted)
    from cavsumo.cli.commands.report import report

    return report(options.results, wanted)


def _merge(options: argparse.Namespace) -> int:
    from cavsumo.results.reading import check_apart, read_manifest

    check_apart(options.output, options.parts)
    for part in options.parts:
        read_manifest(part)
    from cavsumo.cli.commands.merge import merge

    return merge(options.parts, options.output, options.overwrite, options.quiet)
