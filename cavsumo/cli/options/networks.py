"""Options of inspect and import-osm; the heavy parts are imported when they are called."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cavsumo.cli.options.values import values_of
from cavsumo.model.named_networks import names


def net_help() -> str:
    """The help for a network on the command line."""
    return f"SUMO network (.net.xml, .net.xml.gz), or by name: {', '.join(names())}"


def add_inspect(commands: Any) -> None:
    """The command inspect."""
    inspect = commands.add_parser(
        "inspect",
        help="say what a network offers a test",
        description="Say what a network offers a test: its figures, the junctions worth testing, "
        "the ego's ways through them and where testers can meet it.",
        allow_abbrev=False,
    )
    add = inspect.add_argument
    add("net", type=Path, metavar="NET", help=net_help())
    add("--junction", metavar="ID", help="look at this one (default: the best ones)")
    add("--top", type=int, default=5, metavar="N", help="number of junctions (default 5)")
    add("--json", dest="as_json", action="store_true", help="print JSON (docs/inspect.md)")
    add("--picture", type=Path, metavar="FILE", help="draw the best junction (.png, .svg, .pdf)")
    inspect.set_defaults(command=_inspect)


def add_import_osm(commands: Any) -> None:
    """The command import-osm."""
    osm = commands.add_parser(
        "import-osm",
        help="make a network from OpenStreetMap data",
        description="Make a network from OpenStreetMap data with SUMO's netconvert; needs the "
        "extra: pip install 'cavsumo[osm]'.",
        allow_abbrev=False,
    )
    add = osm.add_argument
    add("source", type=Path, metavar="FILE", help=".osm, .osm.xml, the same as .gz, or .pbf")
    add("-o", "--output", required=True, type=Path, metavar="FILE", help="NAME.net.xml")
    add("--bbox", metavar="W,S,E,N", help="only roads that touch this box, in degrees")
    hand = osm.add_mutually_exclusive_group().add_argument
    hand(
        "--left-hand",
        action="store_true",
        default=None,
        help="traffic keeps left (default: as where the extract lies, right if in doubt)",
    )
    hand("--right-hand", dest="left_hand", action="store_false", help="traffic keeps right")
    add("--zebra", action="store_true", help="priority for pedestrians where there are no signals")
    add(
        "--keep-pedestrian-signals",
        action="store_true",
        help="keep signals away from junctions; they may be badly timed",
    )
    add("--overwrite", action="store_true", help="replace another network")
    add(
        "--time-limit",
        dest="time_limit_s",
        type=float,
        default=600.0,
        metavar="S",
        help="for netconvert [s] (default 600)",
    )
    osm.set_defaults(command=_import_osm)


def _inspect(options: argparse.Namespace) -> int:
    from cavsumo.cli.requests.inspect import InspectOptions, check_inspect

    look = InspectOptions(**values_of(options, InspectOptions))
    check_inspect(look)
    from cavsumo.cli.commands.inspect import inspect

    return inspect(look)


def _import_osm(options: argparse.Namespace) -> int:
    from cavsumo.cli.requests.import_osm import ImportOptions, check_import

    order = ImportOptions(**values_of(options, ImportOptions))
    check_import(order)
    from cavsumo.cli.commands.import_osm import import_osm

    return import_osm(order)
