"""Options of the command import; the heavy parts are imported when it is called."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cavsumo.cli.options.values import values_of


def add_import(commands: Any) -> None:
    """The command import."""
    parser = commands.add_parser(
        "import",
        help="read an exported episode again",
        description="Read an episode that was exported as recorded (OpenSCENARIO or CommonRoad): "
        "its tracks are judged once more, and written as a trace, which replay --recorded and "
        "export take.",
        allow_abbrev=False,
    )
    add = parser.add_argument
    add("file", type=Path, metavar="FILE", help="a .xosc or .xml of cavsumo export")
    add("-n", "--net", type=Path, metavar="NET", help="where the network is, or its name")
    add(
        "-o", "--output", type=Path, required=True, metavar="TRACE",
        help="the trace (.jsonl.gz)",
    )  # fmt: skip
    add("--trust", action="store_true", help="use an assertion that only the file names")
    parser.set_defaults(command=_import)


def _import(options: argparse.Namespace) -> int:
    from cavsumo.cli.requests.imports import ImportEpisodeOptions, check_import

    wanted = ImportEpisodeOptions(**values_of(options, ImportEpisodeOptions))
    check_import(wanted)
    from cavsumo.cli.commands.imports import import_episode

    return import_episode(wanted)
