"""Random trips of cars over the roads around the ego's path, by the fastest way."""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from shapely.geometry import LineString

from cavsumo.network.reader import Network, driving_lanes, is_normal, lane_shape

REACH_M = 300.0  # roads farther than this from the ego's path have no traffic
BORDER = 10.0  # how many times more trips begin and end on a metre of road at the border
LEAST_ROADS = 3  # trips are at least that many roads long where possible


@dataclass(frozen=True)
class Road:
    """A road for cars, with the data that trips need.

    Attributes:
        id: of its edge.
        length: [m].
        time: to drive along it when it is free [s].
        entrance, exit: whether cars come in from outside here, or leave.
        onward: the roads that a car can take at its end, turning round left out.
    """

    id: str
    length: float
    time: float
    entrance: bool
    exit: bool
    onward: tuple[str, ...]


def is_near(lane: Any, line: LineString) -> bool:
    """Whether a lane is near enough to the ego's path to have traffic."""
    return bool(LineString(lane_shape(lane)).distance(line) <= REACH_M)


def roads_near(network: Network, line: LineString) -> dict[str, Road]:
    """The roads near the ego's path on which cars may drive, by id, in the order of their ids."""
    near = [e for e in network.edges if any(is_near(lane, line) for lane in driving_lanes(e)[:1])]
    onward = {str(e.getID()): _onward(e) for e in network.edges if driving_lanes(e)}
    before: dict[str, list[str]] = {}
    for name, others in onward.items():
        for other in others:
            before.setdefault(other, []).append(name)
    names = [str(edge.getID()) for edge in near]
    known = set(names)
    return {
        name: Road(
            id=name,
            length=float(edge.getLength()),
            time=float(edge.getLength()) / max(0.1, float(edge.getSpeed())),
            entrance=not known.issuperset(before.get(name, [""])),
            exit=not known.issuperset(onward[name] or [""]),
            onward=tuple(other for other in onward[name] if other in known),
        )
        for name, edge in zip(names, near, strict=True)
    }


def _onward(edge: Any) -> list[str]:
    """Ids of the roads that a car can take at the end of one, in order."""
    return sorted(
        str(other.getID())
        for other in edge.getAllowedOutgoing("passenger")
        if is_normal(other) and other.getToNode() is not edge.getFromNode()
    )


class Trips:
    """Random trips by the fastest way.

    Args:
        roads: all there are, by id.
        avoided: ids of roads on which no trip begins unless there are no others.
        rng: consumed by each trip.
    """

    def __init__(
        self, roads: dict[str, Road], avoided: Iterable[str], rng: np.random.Generator
    ) -> None:
        self.rng = rng
        self._roads = roads
        apart = set(avoided)
        self._origins = [r for r in roads.values() if r.id not in apart] or list(roads.values())
        self._trees: dict[str, dict[str, list[str]]] = {}

    def draw(self) -> list[Road]:
        """The roads of a trip."""
        start = self._choice(self._origins, [r.entrance for r in self._origins])
        if start.id not in self._trees:
            self._trees[start.id] = _ways(self._roads, start.id)
        ways = self._trees[start.id]
        least = min(LEAST_ROADS, max(map(len, ways.values())))
        ends = [self._roads[name] for name, way in ways.items() if len(way) >= least]
        end = self._choice(ends, [r.exit for r in ends])
        return [self._roads[name] for name in ways[end.id]]

    def _choice(self, roads: Sequence[Road], border: Sequence[bool]) -> Road:
        """A road, by length, and more probably one at the border."""
        ratio = [r.length * (BORDER if b else 1.0) for r, b in zip(roads, border, strict=True)]
        weights = np.cumsum(ratio)
        drawn = self.rng.uniform(0.0, float(weights[-1]))
        return roads[min(int(np.searchsorted(weights, drawn, side="right")), len(roads) - 1)]


def _ways(roads: dict[str, Road], start: str) -> dict[str, list[str]]:
    """The fastest way from a road to each reachable road (Dijkstra); ties by id."""
    ways: dict[str, list[str]] = {}
    waiting: list[tuple[float, str, str]] = [(0.0, start, "")]
    while waiting:
        time, name, before = heapq.heappop(waiting)
        if name in ways:
            continue
        ways[name] = [*ways.get(before, []), name]
        for other in roads[name].onward:
            if other not in ways:
                heapq.heappush(waiting, (time + roads[other].time, other, name))
    return ways
