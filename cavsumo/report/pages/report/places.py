"""Maps of the places of tests: dots on the network, nearby ones merged.

A test is shown at its tester's place at the trigger, a failure also at that of the impact.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from cavsumo.network.drawing.place import View, site_drawn
from cavsumo.report.analysis import Report
from cavsumo.report.compare import EVENTS
from cavsumo.report.events import Event
from cavsumo.report.pages.report.scenes import BatchPlace

PASSED, FAILED, IMPACT = "passed", "failed", "impact"
MEANING = {
    PASSED: "trigger of a test that the ego passed",
    FAILED: "trigger of a test that the ego failed",
    IMPACT: "where the ego failed it",
}
MOST = 1500  # dots on a map
APART_M = 0.5  # dots that are closer become one; more where there are too many
MARGIN_M, LEAST_M = 20.0, 60.0  # of network around the dots; least size of the view


class Spot(NamedTuple):
    """An event of a run on the map.

    Attributes:
        x, y: where [m].
        group: index of its group.
        sort: passed, failed or impact.
        run: number of its row in the evidence.
    """

    x: float
    y: float
    group: int
    sort: str
    run: int


class Dot(NamedTuple):
    """Spots that are close together, of one group and one sort.

    Attributes:
        x, y: their middle [m].
        many: their number.
        run: the first of them.
    """

    x: float
    y: float
    group: int
    sort: str
    many: int
    run: int


@dataclass(frozen=True)
class Map:
    """A network with dots, in metres to the right and down from its upper left corner.

    Attributes:
        name: of the network.
        problem: why the network is not drawn, empty if it is.
        width, height, radius: of the view, and of a dot for one [m].
        areas, lines: outlines of the network, as SVG paths by kind.
        dots: places of events, the rarer kinds last.
        groups: those that have any.
        apart: events closer together than this are merged into one dot [m].
        credit: the attribution that the licence of the map data requires.
    """

    name: str
    problem: str
    width: float
    height: float
    radius: float
    areas: Mapping[str, str]
    lines: Mapping[str, str]
    dots: Sequence[Dot]
    groups: Sequence[int]
    apart: float
    credit: str


def maps(report: Report, scenes: Sequence[BatchPlace]) -> list[Map]:
    """A map for each scene with a test of known place."""
    spots: dict[int, list[Spot]] = {}
    runs = report.evidence.rows["run"]
    for batch, spot in _spots(report):
        run = int(runs[spot.run])
        scene = next(i for i, scene in enumerate(scenes) if scene.has(batch, run))
        spots.setdefault(scene, []).append(spot)
    return [_map(scenes[i], spots[i]) for i in sorted(spots)]


def _spots(report: Report) -> Iterator[tuple[int, Spot]]:
    """All events whose place is known, each with its batch."""
    for i, group in enumerate(report.groups):
        for index, batch in group.rows.loc[EVENTS["tests"](group.rows), "batch"].items():
            test = report.tests[int(index)]
            sort = PASSED if test.impact is None else FAILED
            events: list[tuple[str, Event | None]] = [(sort, test.trigger), (IMPACT, test.impact)]
            for what, event in events:
                if event is not None and event.x is not None and event.y is not None:
                    yield int(batch), Spot(event.x, event.y, i, what, int(index))


def merged(spots: Sequence[Spot], most: int = MOST) -> tuple[list[Dot], float]:
    """Spots merged into one dot for each cell of a grid, and the width of the cells [m]."""
    apart = APART_M
    while True:
        cells: dict[tuple[int, int, int, str], list[Spot]] = {}
        for spot in spots:
            place = math.floor(spot.x / apart), math.floor(spot.y / apart)
            cells.setdefault((*place, spot.group, spot.sort), []).append(spot)
        if len(cells) <= most or apart > 1000.0:
            break
        apart *= 2.0
    dots = [
        Dot(
            _mean(s.x for s in some), _mean(s.y for s in some), *some[0][2:4], len(some), some[0][4]
        )
        for some in cells.values()
    ]
    order = list(MEANING)
    return sorted(dots, key=lambda dot: (order.index(dot.sort), -dot.many)), apart


def _mean(values: Iterable[float]) -> float:
    """Their mean."""
    found = list(values)
    return math.fsum(found) / len(found)


def _map(scene: BatchPlace, spots: Sequence[Spot]) -> Map:
    """A map of some spots."""
    dots, apart = merged(spots)
    west, south, east, north = view = _view(dots)
    areas: dict[str, str] = {}
    lines: dict[str, str] = {}
    named = ""
    if scene.site is not None:
        place = site_drawn(scene.site)
        seen, named = place.within(view), place.credit
        areas = {role: _path(parts, view, "Z") for role, parts in seen.areas.items()}
        lines = {role: _path(parts, view, "") for role, parts in seen.lines.items()}
    moved = [dot._replace(x=round(dot.x - west, 2), y=round(north - dot.y, 2)) for dot in dots]
    return Map(
        name=scene.name,
        problem=scene.problem,
        width=round(east - west, 1),
        height=round(north - south, 1),
        radius=round(max(0.35, (east - west) / 160), 2),
        areas=areas,
        lines=lines,
        dots=moved,
        groups=sorted({dot.group for dot in dots}),
        apart=apart,
        credit=named,
    )


def _view(dots: Sequence[Dot]) -> View:
    """The view of all dots, with some network around; not too small, not too high."""
    xs, ys = [dot.x for dot in dots], [dot.y for dot in dots]
    x, y = (min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2
    wide = max(LEAST_M, max(xs) - min(xs) + 2 * MARGIN_M)
    high = max(LEAST_M * 0.6, max(ys) - min(ys) + 2 * MARGIN_M)
    wide, high = max(wide, high * 0.9), max(high, wide * 0.45)
    return x - wide / 2, y - high / 2, x + wide / 2, y + high / 2


def _path(parts: Iterable[Sequence[Any]], view: View, end: str) -> str:
    """Outlines as the data of an SVG path."""
    west, _, _, north = view
    return "".join(
        "M" + "L".join(f"{p[0] - west:.2f} {north - p[1]:.2f}" for p in part) + end
        for part in parts
    )
