"""The lanes near an episode as lanelets: strips between a left and a right bound.

A lanelet is a lane of SUMO, a lane through a junction, a pavement or a crossing, with bounds half a
width to the left and right of its shape, in its direction of travel. Successors are those of SUMO's
connections, neighbours the lanes of the same edge. Walking areas, which are no strips, traffic
lights, signs and rules of right of way are not converted.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from shapely import STRtree
from shapely.geometry import LineString, MultiLineString
from shapely.geometry.base import BaseGeometry

from cavsumo.model.polyline import Point
from cavsumo.network.reader import Network, is_pavement, lane_shape, read_network

NEAR_M = 30.0  # from the tracks and the ego's path
SHARPEST = 0.25  # cosine of half a bend; the bound of a sharper one is not drawn out further
TOUCH_M = 1e-6
ROAD, INSIDE, PAVEMENT, CROSSING = "urban", "intersection", "sidewalk", "crosswalk"


@dataclass(frozen=True)
class Strip:
    """A lanelet.

    Attributes:
        id: from 1.
        kind: ROAD, INSIDE, PAVEMENT or CROSSING.
        left, right: its bounds, with as many points.
        before, after: ids of its predecessors and successors.
        left_id, right_id: of its neighbours of the same direction.
    """

    id: int
    kind: str
    left: Sequence[Point]
    right: Sequence[Point]
    before: tuple[int, ...]
    after: tuple[int, ...]
    left_id: int | None
    right_id: int | None


def strips(net: Path, lines: Sequence[Sequence[Point]]) -> list[Strip]:
    """The lanelets of a network near some lines, in the order of the ids of their lanes."""
    network = read_network(net)
    lanes = dict(sorted(_near(_lanes(network), _union(lines)).items()))
    numbers = {name: i for i, name in enumerate(lanes, 1)}
    after = {name: _after(lane, numbers) for name, lane in lanes.items()}
    before: dict[int, list[int]] = {number: [] for number in numbers.values()}
    for name, targets in after.items():
        for target in targets:
            before[target].append(numbers[name])
    return [
        _strip(lane, numbers, tuple(before[numbers[name]]), after[name], network)
        for name, lane in lanes.items()
    ]


def _lanes(network: Network) -> Iterator[Any]:
    """All lanes that are strips."""
    for edge in network.edges:
        yield from edge.getLanes()
    for function in ("internal", "crossing"):
        for edge in network.inside(function):
            yield from edge.getLanes()


def _union(lines: Sequence[Sequence[Point]]) -> BaseGeometry:
    """Some lines as one shape; a line of one point is a short one."""
    long = [
        line if len(line) > 1 else [*line, (line[0][0] + TOUCH_M, line[0][1])] for line in lines
    ]
    return MultiLineString([LineString(line) for line in long])


def _near(lanes: Iterator[Any], lines: BaseGeometry) -> dict[str, Any]:
    """The lanes near some lines, by their ids."""
    there = list(lanes)
    shapes = [LineString(lane_shape(lane)) for lane in there]
    found = STRtree(shapes).query(lines, predicate="dwithin", distance=NEAR_M)
    return {str(there[i].getID()): there[i] for i in found}


def _after(lane: Any, numbers: Mapping[str, int]) -> tuple[int, ...]:
    """The ids of the lanelets that follow."""
    names = [link.getViaLaneID() or link.getToLane().getID() for link in lane.getOutgoing()]
    return tuple(dict.fromkeys(numbers[name] for name in names if name in numbers))


def _strip(
    lane: Any,
    numbers: Mapping[str, int],
    before: tuple[int, ...],
    after: tuple[int, ...],
    network: Network,
) -> Strip:
    """A lane as a lanelet."""
    shape, half = _distinct(lane_shape(lane)), lane.getWidth() / 2.0
    inner, outer = (_neighbour(lane, step, numbers) for step in (1, -1))
    left_id, right_id = (outer, inner) if network.left_hand else (inner, outer)
    bounds = beside(shape, half), beside(shape, -half)
    return Strip(numbers[lane.getID()], _kind(lane), *bounds, before, after, left_id, right_id)


def _kind(lane: Any) -> str:
    """The kind of a lane."""
    function = lane.getEdge().getFunction()
    if function in ("internal", "crossing"):
        return INSIDE if function == "internal" else CROSSING
    return PAVEMENT if is_pavement(lane) else ROAD


def _neighbour(lane: Any, step: int, numbers: Mapping[str, int]) -> int | None:
    """The id of the lane so many places farther from the kerb on the same edge."""
    lanes, index = lane.getEdge().getLanes(), lane.getIndex() + step
    if not 0 <= index < len(lanes):
        return None
    return numbers.get(str(lanes[index].getID()))


def _distinct(points: Sequence[Point]) -> list[Point]:
    """A line without points that are where the one before is."""
    found = [points[0]]
    for point in points[1:]:
        if math.dist(point, found[-1]) > TOUCH_M:
            found.append(point)
    return found if len(found) > 1 else [points[0], (points[0][0] + TOUCH_M, points[0][1])]


def beside(points: Sequence[Point], left: float) -> list[Point]:
    """A line so far [m] to the left of one given, with as many points.

    At a point it lies on the bisector of the two directions, as far as both parallels meet.
    """
    ways = [
        ((bx - ax) / math.dist((ax, ay), (bx, by)), (by - ay) / math.dist((ax, ay), (bx, by)))
        for (ax, ay), (bx, by) in pairwise(points)
    ]
    found = []
    for i, (x, y) in enumerate(points):
        (ux, uy), (vx, vy) = ways[max(i - 1, 0)], ways[min(i, len(ways) - 1)]
        length = math.hypot(ux + vx, uy + vy)
        nx, ny = (-(uy + vy) / length, (ux + vx) / length) if length > TOUCH_M else (-uy, ux)
        reach = left / max(SHARPEST, length / 2.0)
        found.append((x + reach * nx, y + reach * ny))
    return found
