"""``cavsumo inspect``: a network described for tests, as a table, as JSON, as a picture."""

from __future__ import annotations

import dataclasses
import io
import json
import shlex
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from cavsumo.cli.requests.inspect import InspectOptions
from cavsumo.cli.steps import SlowSteps, say_written
from cavsumo.egos.base import EGO_KIND
from cavsumo.errors import Exit, NetworkError
from cavsumo.model.named_networks import network_file
from cavsumo.network.facts import Facts, facts
from cavsumo.network.inspection import (
    InspectedNetwork,
    Junction,
    Way,
    best_junctions,
    ground,
    junction,
)
from cavsumo.network.pedestrian_starts import StartingArea
from cavsumo.network.reader import read_network

FORMAT = 1  # of the JSON; raised when a key changes its meaning or goes
WIDTH = 120


def inspect(look: InspectOptions) -> int:
    """Describe a network."""
    draw = _drawing(look.picture)
    with SlowSteps() as steps:
        found, here, junctions = _seen(look, steps)
        if draw is not None:
            steps.begin(f"drawing {look.picture}")
            unwritten = draw(here, junctions[0] if junctions else None, look.picture)
            _note_unwritten(unwritten)
    say_written([look.picture])
    if look.as_json:
        print(json.dumps(as_json(look.net, found, junctions), ensure_ascii=not _utf8(), indent=2))
    else:
        _print(_shown(look, found, junctions))
    return Exit.OK


def _seen(look: InspectOptions, steps: SlowSteps) -> tuple[Facts, InspectedNetwork, list[Junction]]:
    """The facts and junctions of a network."""
    steps.begin(f"reading {look.net}")
    network = read_network(network_file(look.net))
    try:
        found = facts(network)
        here = ground(network, EGO_KIND.length / 2)
        steps.begin("looking for junctions that testers reach")
        return found, here, _junctions(here, look)
    except ValueError as error:  # shapes without points, widths that are none
        raise NetworkError(f"network {str(look.net)!r}: {error}") from error


def _note_unwritten(names: Sequence[str]) -> None:
    """Print the names of streets that are missing in the picture."""
    if names:
        said = _printable(", ".join(names))
        print(
            f"cavsumo: note: no font on this machine can write {said}, which the picture lacks; "
            "fonts such as Noto Sans CJK have many letters",
            file=sys.stderr,
        )


def _junctions(here: InspectedNetwork, look: InspectOptions) -> list[Junction]:
    """The chosen junction, or the best ones."""
    if look.junction is not None:
        return [junction(here, here.network.junction(look.junction))]
    return best_junctions(here, look.top)


def _drawing(picture: Path | None) -> Any:
    """The function that draws, imported if a picture is requested."""
    if picture is None:
        return None
    from cavsumo.network.drawing.picture import draw

    return draw


# JSON


def as_json(net: Path, found: Facts, junctions: list[Junction]) -> dict[str, Any]:
    """The records as JSON, with stable keys (docs/inspect.md)."""
    return {
        "format": FORMAT,
        "network": str(net),
        "facts": dataclasses.asdict(found),
        "junctions": [
            {
                "rank": rank,
                **{f.name: getattr(j, f.name) for f in dataclasses.fields(j) if f.name != "ways"},
                "ways": [_way_json(way) for way in j.ways],
            }
            for rank, j in enumerate(junctions, 1)
        ],
    }


def _way_json(way: Way) -> dict[str, Any]:
    """A way through a junction."""
    return {
        "turn": way.turn,
        "into": way.into,
        "out": way.out,
        "streets": way.streets,
        "edges": way.route.edges,
        "lane": way.route.lane,
        "depart_m": way.route.depart_m,
        "arrive_m": way.route.arrive_m,
        "length_m": round(way.route.path.length, 2),
        "crossings": way.crossings,
        "starting_areas": [_area_json(area) for area in way.areas],
    }


def _area_json(area: StartingArea) -> dict[str, Any]:
    """A starting area: the pavement's edge, and its axis from begin to end."""
    axis = area.pavement.cut(area.begin, area.end)
    return {
        "edge": area.walk[0],
        "begin_m": round(area.begin, 2),
        "end_m": round(area.end, 2),
        "width_m": area.width,
        "axis": [[round(x, 2), round(y, 2)] for x, y in axis.points],
    }


# Table


def _utf8() -> bool:
    """Whether stdout can write every letter."""
    return (sys.stdout.encoding or "").lower().replace("-", "") == "utf8"


def _print(text: str) -> None:
    """Print on stdout, with the letters that it can write."""
    print(_printable(text), end="")


def _printable(text: str) -> str:
    """A text with the letters that stdout cannot write escaped."""
    encoding = sys.stdout.encoding or "utf-8"
    return text.encode(encoding, "backslashreplace").decode(encoding)


def _shown(look: InspectOptions, found: Facts, junctions: list[Junction]) -> str:
    """Facts and junctions as a text."""
    text = io.StringIO()
    console = Console(width=WIDTH, file=text)
    console.print(_facts_table(look.net, found))
    for rank, j in enumerate(junctions, 1):
        _say(console, f"\n{_heading(rank, j)}")
        console.print(_ways_table(j.ways))
    if not junctions:
        _say(console, "\nno junction to drive through: the ego follows the longest road")
    asked = "" if look.junction is None else f" --junction {shlex.quote(junctions[0].id)}"
    _say(
        console,
        "\nstarting areas: pavements from which the way across the road meets the ego's path"
        f"\n       cavsumo run --net {shlex.quote(str(look.net))}{asked}",
    )
    return text.getvalue()


def _say(console: Console, text: str) -> None:
    """Print plain text, never wrapped, marked up or coloured."""
    console.print(text, markup=False, highlight=False, soft_wrap=True)


def _facts_table(net: Path, found: Facts) -> Table:
    """The facts, a line for each group."""
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for name, text in _lines(net, found):
        table.add_row(Text(name), Text(text))
    return table


def _lines(net: Path, found: Facts) -> Iterator[tuple[str, str]]:
    """The facts in words."""
    yield "network", f"{net} (format {found.format}), {found.width_m:.0f} x {found.height_m:.0f} m"
    yield (
        "roads",
        f"{found.edges} edges with {found.lanes} lanes: {found.car_lanes} for cars, "
        f"{found.pavements} pavements; {_count(found.components, 'component')}",
    )
    yield (
        "junctions",
        f"{found.junctions} and {_count(found.dead_ends, 'dead end')}; "
        f"{_count(found.traffic_lights, 'traffic light')}",
    )
    yield (
        "crossings",
        f"{found.crossings}: {found.crossings_with_signals} at traffic lights, "
        f"{found.crossings_with_priority} with priority, {found.crossings_without_priority} "
        f"without; {_count(found.walking_areas, 'walking area')}",
    )
    yield "traffic", f"keeps {'left' if found.left_hand else 'right'}"
    if found.centre is not None:
        yield "centre", "{:.5f}, {:.5f} (latitude, longitude)".format(*found.centre)
    for note in found.notes:
        yield "note", note


def _heading(rank: int, j: Junction) -> str:
    """A junction in one line."""
    streets = f" ({', '.join(j.streets)})" if j.streets else ""
    where = "" if j.centre is None else ", at {:.5f}, {:.5f}".format(*j.centre)
    others = [piece for piece in j.pieces if piece != j.id]
    parts = f", one intersection with {', '.join(others)}" if others else ""
    crossings = _count(j.crossings, "crossing")
    return f"{rank}. junction {j.id}{streets}: {j.type}, {crossings}{where}{parts}"


def _ways_table(ways: tuple[Way, ...]) -> Table:
    """The ways through a junction, a line each."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column("  ego", no_wrap=True, width=10)
    table.add_column("from edge", overflow="fold", width=27)
    table.add_column("to edge", overflow="fold", width=27)
    table.add_column("over crossings", justify="right", no_wrap=True)
    table.add_column("starting areas", justify="right", no_wrap=True)
    for way in ways:
        areas = f"{len(way.areas)}, {way.area_m:.0f} m" if way.areas else "none"
        cells = [f"  {way.turn}", way.into, way.out, str(len(way.crossings)), areas]
        table.add_row(*map(Text, cells))
    return table


def _count(number: int, noun: str) -> str:
    """A number with its noun."""
    return f"{number} {noun}{'' if number == 1 else 's'}"
