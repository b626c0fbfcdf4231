"""Where tester pedestrians start: on the pavements beside the ego's path, seeded."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from shapely.geometry import LineString

from cavsumo.errors import NetworkError
from cavsumo.model.bodies import Kind
from cavsumo.model.carriageway import Roads, Start
from cavsumo.model.polyline import Path
from cavsumo.network.reader import Network, lane_shape, pavement_walk

NEAR_M = 20.0  # pavements farther than this from the ego's path are left out
PIECE_M = 1.0  # resolution at which a pavement is judged
APART_M = 1.2  # two testers do not start closer together than this
ATTEMPTS = 50

# The ways across the road from the pieces of pavements, by the ids of their lanes.
WaysAcross = dict[str, "np.ndarray[Any, Any]"]


@dataclass(frozen=True)
class StartingArea:
    """A stretch of pavement from which a pedestrian can cross the ego's path.

    Attributes:
        pavement: its axis.
        begin, end: the stretch, as arc lengths on the axis [m].
        width: of the pavement [m].
        walk: ids of its edge and of one that leads on from it, for SUMO's persons.
    """

    pavement: Path
    begin: float
    end: float
    width: float
    walk: tuple[str, ...]


def starting_areas(
    network: Network, roads: Roads, ego_path: Path, known: WaysAcross | None = None
) -> tuple[StartingArea, ...]:
    """All stretches of pavement near the ego's path whose way across the road meets it.

    ``known`` keeps the ways across for the next route. Raises NetworkError when the network has no
    pavements, or none of them lies near enough.
    """
    known = {} if known is None else known
    if next(network.pavements(), None) is None:
        raise NetworkError(
            f"{network.file}: has no pavements for pedestrians to start on; rebuild it with "
            "netconvert --sidewalks.guess --crossings.guess, let them start beside the road with "
            "--jaywalk, or test with vehicles (--kind car)"
        )
    line = LineString(ego_path.points)
    near = network.pavements_near(line, NEAR_M)
    shapely.prepare(line)
    areas = [area for lane in near for area in _stretches(lane, roads, line, known)]
    if not areas:
        raise NetworkError(
            f"{network.file}: no pavement lies beside the ego's route; choose another with "
            "--ego-route or --junction, or let testers start beside the road with --jaywalk"
        )
    return tuple(areas)


def draw_starts(
    areas: Sequence[StartingArea], kinds: Sequence[Kind], rng: np.random.Generator
) -> tuple[Start, ...]:
    """One start for each body, uniform over the areas, apart from each other, facing along.

    Consumes the generator. Raises NetworkError when the bodies do not fit.
    """
    starts: list[Start] = []
    for kind in kinds:
        for _ in range(ATTEMPTS):
            start = _draw(areas, kind, rng)
            if all(math.dist((start.x, start.y), (s.x, s.y)) > APART_M for s in starts):
                starts.append(start)
                break
        else:
            raise NetworkError(f"no room for {len(kinds)} testers on the pavements: use fewer")
    return tuple(starts)


def _stretches(
    lane: Any, roads: Roads, ego_line: LineString, known: WaysAcross
) -> list[StartingArea]:
    """The runs of a pavement whose pieces all lead across the ego's path."""
    pavement, width = Path(lane_shape(lane)), float(lane.getWidth())
    walk = pavement_walk(lane.getEdge())
    name = str(lane.getID())
    if name not in known:
        known[name] = ways_across(pavement, roads)
    return stretches(pavement, width, walk, shapely.intersects(ego_line, known[name]).tolist())


def stretches(
    pavement: Path, width: float, walk: tuple[str, ...], met: Sequence[bool]
) -> list[StartingArea]:
    """The runs of pieces of a pavement that lead across the ego's path, by what each of them does.

    The pieces are of the same length.
    """
    piece = pavement.length / len(met)
    found: list[StartingArea] = []
    begin: float | None = None
    for i, good in enumerate([*met, False]):
        if good and begin is None:
            begin = i * piece
        elif not good and begin is not None:
            found.append(StartingArea(pavement, begin, i * piece, width, walk))
            begin = None
    return found


def ways_across(pavement: Path, roads: Roads) -> np.ndarray[Any, Any]:
    """The way across the road from each piece of a pavement, as lines, None where there is none."""
    count = max(1, round(pavement.length / PIECE_M))
    piece = pavement.length / count
    ways = np.empty(count, dtype=object)
    for i in range(count):
        x, y, _ = pavement.at((i + 0.5) * piece)
        way = roads.crossing(x, y)
        if way is not None and way.enter <= NEAR_M:
            end = (x + way.leave * math.cos(way.heading), y + way.leave * math.sin(way.heading))
            ways[i] = LineString([(x, y), end])
    return ways


def _draw(areas: Sequence[StartingArea], kind: Kind, rng: np.random.Generator) -> Start:
    """A start for a body of that kind, its box on the pavement whichever way it turns."""
    margin = math.hypot(kind.length, kind.width) / 2
    weights = np.array([(a.end - a.begin) * a.width for a in areas])
    area = areas[int(rng.choice(len(areas), p=weights / weights.sum()))]
    low, high = max(area.begin, margin), min(area.end, area.pavement.length - margin)
    along = float(rng.uniform(low, high)) if low < high else (area.begin + area.end) / 2
    room = max(0.0, area.width / 2 - margin)
    lateral = float(rng.uniform(-room, room))
    forwards = bool(rng.integers(2))
    x, y, o = area.pavement.at(along)
    x, y = x - lateral * math.sin(o), y + lateral * math.cos(o)
    if not forwards:
        o = math.atan2(-math.sin(o), -math.cos(o))
    return Start(x, y, o, area.pavement, lateral, forwards, area.walk)
