"""The starts of tester pedestrians on the pavements beside the ego's path, drawn from a seed.

No pedestrian starts in another body, or too near to stop before it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from shapely.geometry import LineString

from cavsumo.errors import NetworkError
from cavsumo.model.bodies import Kind
from cavsumo.model.carriageway import Roads, Start
from cavsumo.model.geometry import Box
from cavsumo.model.polyline import Path
from cavsumo.model.stopping_way import is_clear, stopping_way, stretched
from cavsumo.network.reader import Network, lane_shape, pavement_walk

NEAR_M = 20.0  # pavements farther than this from the ego's path are left out
PIECE_M = 1.0  # resolution at which a pavement is judged
APART_M = 1.2  # two testers do not start closer together than this
ATTEMPTS = 50
STOPPING_S = 0.2  # the room ahead of a start is counted with timesteps of this length

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

    Two bodies have room to stop before each other, unless only starts without that room remain.
    Consumes the generator. Raises NetworkError when the bodies do not fit.
    """
    starts: list[Start] = []
    for kind in kinds:
        rooms = [room(s, k) for s, k in zip(starts, kinds, strict=False)]
        drawn = list(_draws(areas, kind, rng, starts, rooms))
        if not drawn:
            raise NetworkError(f"no room for {len(kinds)} testers on the pavements: use fewer")
        starts.append(drawn[-1])
    return tuple(starts)


def clear_starts(
    areas: Sequence[StartingArea],
    kinds: Sequence[Kind],
    starts: Sequence[Start],
    taken: Sequence[Box],
    rng: np.random.Generator,
) -> tuple[Start, ...]:
    """The same starts, but those that are not clear of the boxes of others drawn again.

    If no draw succeeds, the start is moved along the pavements. Consumes the generator if a start
    has to be drawn. Raises NetworkError when there is no room.
    """
    found = list(starts)
    for i, kind in enumerate(kinds):
        if not found[i].pavement or is_clear(room(found[i], kind), taken):
            continue
        apart = [*found[:i], *found[i + 1 :]]
        rooms = [room(s, k) for s, k in zip(apart, (*kinds[:i], *kinds[i + 1 :]), strict=True)]
        rooms += taken
        tried = (*_draws(areas, kind, rng, apart, rooms), *_along(areas, kind))
        clear = (s for s in tried if _apart(s, apart) and is_clear(room(s, kind), rooms))
        start = next(clear, None)
        if start is None:
            raise NetworkError(
                f"no room for tester{i} on the pavements: others stand wherever it could start"
            )
        found[i] = start
    return tuple(found)


def room(start: Start, kind: Kind) -> Box:
    """The box of a body at its start and the way that it needs to stop, at its highest speed."""
    box = Box(start.x, start.y, start.o, kind.length, kind.width)
    return stretched(box, stopping_way(kind, kind.v_max, STOPPING_S))


def _draws(
    areas: Sequence[StartingArea],
    kind: Kind,
    rng: np.random.Generator,
    starts: Sequence[Start],
    rooms: Sequence[Box],
) -> Iterator[Start]:
    """Starts apart from others, until one has clear room ahead, or the draws are used up."""
    for _ in range(ATTEMPTS):
        start = _draw(areas, kind, rng)
        if _apart(start, starts):
            yield start
            if is_clear(room(start, kind), rooms):
                return


def _along(areas: Sequence[StartingArea], kind: Kind) -> Iterator[Start]:
    """Starts on the axes of all areas, one after another, facing along and against."""
    for area in areas:
        low, high = starting_range(area, kind)
        for i in range(1 + max(0, int((high - low) / PIECE_M))):
            for forwards in (True, False):
                yield _start(area, low + i * PIECE_M, 0.0, forwards)


def _apart(start: Start, others: Iterable[Start]) -> bool:
    """Whether a start is far enough from others."""
    return all(math.dist((start.x, start.y), (s.x, s.y)) > APART_M for s in others)


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
    """The runs of pieces of a pavement that lead across the ego's path, given whether each does.

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
    low, high = starting_range(area, kind)
    along = float(rng.uniform(low, high)) if low < high else low
    aside = max(0.0, area.width / 2 - margin)
    lateral = float(rng.uniform(-aside, aside))
    return _start(area, along, lateral, bool(rng.integers(2)))


def starting_range(area: StartingArea, kind: Kind) -> tuple[float, float]:
    """The interval of arc lengths in which a body may start on an area [m]."""
    margin = math.hypot(kind.length, kind.width) / 2
    low, high = max(area.begin, margin), min(area.end, area.pavement.length - margin)
    middle = (area.begin + area.end) / 2
    return (low, high) if low < high else (middle, middle)


def _start(area: StartingArea, along: float, lateral: float, forwards: bool) -> Start:
    """A start at an arc length and offset of an area's pavement."""
    x, y, o = area.pavement.at(along)
    x, y = x - lateral * math.sin(o), y + lateral * math.cos(o)
    if not forwards:
        o = math.atan2(-math.sin(o), -math.cos(o))
    return Start(x, y, o, area.pavement, lateral, forwards, area.walk)
