"""Background traffic for any network, drawn from its own roads, as the text of a route file.

Cars enter and leave mostly at the border of the network and take the fastest way. At the beginning
the cars are on the road that would have departed before. Pedestrians walk from pavement to
pavement. Roads far from the ego's path are left out: no body comes from there during an episode,
and the traffic of a large network would cost more than the test.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from shapely.geometry import LineString

from cavsumo.model.polyline import Point
from cavsumo.network.ego_routes import EgoRoute
from cavsumo.network.reader import Network, is_pavement, lane_shape
from cavsumo.network.trips import Road, Trips, is_near, roads_near

BEFORE_S = 120.0  # cars on the road at the beginning departed during this time before
WALK_S = 90.0  # number of pedestrians at the beginning: the departures of this time
WALK_M = 250.0  # largest distance of their destinations
MARGIN_M = 2.0  # their distance from the ends of a road
# Distances of the cars on the road at the beginning: from the beginning of a road, before its end,
# from each other, and before the ego's bumper [m].
FROM_BEGINNING_M, BEFORE_END_M, APART_M, CLEAR_M = 6.0, 15.0, 15.0, 40.0
ATTEMPTS = 5
CAR = "background_car"


@dataclass(frozen=True)
class Volume:
    """The density of background traffic.

    Attributes:
        vehicles: cars that set out, per minute and kilometre of road, each direction counted.
        persons: pedestrians that set out, per minute and kilometre of pavement.
        duration: time during which others depart [s].
        seed: of the batch; one demand serves all its episodes.
    """

    vehicles: float
    persons: float
    duration: float
    seed: int


@dataclass(frozen=True)
class Pavement:
    """A road with a pavement: its id and length [m], its middle, the part that it belongs to."""

    id: str
    length: float
    middle: Point
    part: str


def background(network: Network, route: EgoRoute, volume: Volume) -> str:
    """The route file of a volume of traffic around the ego's route: same seed, same bytes."""
    # Apart from the seeds of the episodes, which are drawn from (seed, episode).
    streams = np.random.SeedSequence(volume.seed, spawn_key=(0,)).spawn(2)
    driving, walking = (np.random.default_rng(stream) for stream in streams)
    line = LineString(route.path.points)
    departures = [
        *_cars(roads_near(network, line), route, volume, driving),
        *_persons(pavements_near(network, line), volume, walking),
    ]
    departures.sort(key=lambda departure: departure[0])
    body = "".join(xml for _, xml in departures)
    return f'<routes>\n    <vType id="{CAR}" vClass="passenger"/>\n{body}</routes>\n'


def _times(count: int, duration: float, rng: np.random.Generator) -> list[float]:
    """Times of departure in order [s], none in the first second, which is for the ego."""
    return sorted(round(float(rng.uniform(1.0, duration)), 1) for _ in range(count))


def _count(rate: float, roads: Iterable[Road | Pavement], seconds: float) -> int:
    """How many set out on roads in some time, at a rate per minute and kilometre."""
    return round(rate * math.fsum(road.length for road in roads) / 1000.0 * seconds / 60.0)


# Cars


def _cars(
    roads: dict[str, Road], route: EgoRoute, volume: Volume, rng: np.random.Generator
) -> Iterator[tuple[float, str]]:
    """The cars on the road at the beginning, then the later ones, with their times."""
    trips = Trips(roads, route.edges, rng)
    taken: dict[str, list[float]] = {}
    number = 0
    for _ in range(_count(volume.vehicles, roads.values(), BEFORE_S)):
        placed = _placed(trips, route, taken)
        if placed is not None:
            yield 0.0, _car(number, 0.0, *placed)
            number += 1
    later = _count(volume.vehicles, roads.values(), volume.duration)
    for time in _times(later, volume.duration, rng):
        yield time, _car(number, time, trips.draw(), "base")
        number += 1


def _placed(
    trips: Trips, route: EgoRoute, taken: dict[str, list[float]]
) -> tuple[list[Road], str] | None:
    """The rest of a trip that began before, and how far its first road is driven [m].

    None if the car has arrived, or its place belongs to another car or to the ego's entry.
    """
    for _ in range(ATTEMPTS):
        trip = trips.draw()
        place = _underway(trip, float(trips.rng.uniform(0.0, BEFORE_S)))
        if place is None:
            return None
        rest, along = place
        here = taken.setdefault(rest[0].id, [])
        on_the_ego = rest[0].id == route.edges[0] and along < route.depart_m + CLEAR_M
        if not on_the_ego and all(abs(along - other) >= APART_M for other in here):
            here.append(along)
            return rest, f"{along:.1f}"
    return None


def _underway(trip: Sequence[Road], elapsed: float) -> tuple[list[Road], float] | None:
    """The rest of a trip some time after its beginning [s], and the position on its first road.

    Cars in a road too short for room at both ends have come to the next.
    """
    for i, road in enumerate(trip):
        last = road.length - BEFORE_END_M
        if elapsed >= road.time:
            elapsed -= road.time
        elif last <= FROM_BEGINNING_M:
            elapsed = 0.0
        else:
            along = road.length * elapsed / road.time
            return list(trip[i:]), min(last, max(FROM_BEGINNING_M, along))
    return None


def _car(number: int, time: float, trip: Sequence[Road], position: str) -> str:
    """The XML of a car."""
    edges = quoteattr(" ".join(road.id for road in trip))
    return (
        f'    <vehicle id="bg_car{number}" type="{CAR}" depart="{time:.1f}"'
        f' departLane="best" departPos="{position}" departSpeed="max">\n'
        f"        <route edges={edges}/>\n"
        "    </vehicle>\n"
    )


# Pedestrians


def pavements_near(network: Network, line: LineString) -> list[Pavement]:
    """The roads near the ego's path with a pavement, in the order of their ids."""
    lanes = [
        next(lane for lane in edge.getLanes() if is_pavement(lane))
        for edge in network.edges
        if any(is_pavement(lane) for lane in edge.getLanes())
    ]
    parts = _parts(network)
    return [
        Pavement(
            str(lane.getEdge().getID()),
            float(lane.getLength()),
            _middle(lane),
            parts[str(lane.getEdge().getID())],
        )
        for lane in lanes
        if float(lane.getLength()) > 4 * MARGIN_M and is_near(lane, line)
    ]


def _middle(lane: Any) -> Point:
    """The point half way along a lane."""
    point = LineString(lane_shape(lane)).interpolate(0.5, normalized=True)
    return float(point.x), float(point.y)


def _parts(network: Network) -> dict[str, str]:
    """For each edge one that stands for all that pedestrians reach from it on their own lanes."""
    parent: dict[str, str] = {}

    def root(name: str) -> str:
        while parent.setdefault(name, name) != name:
            parent[name] = name = parent[parent[name]]
        return name

    for edge in network.net.getEdges(withInternal=True):
        name = root(str(edge.getID()))
        for lane in edge.getLanes():
            for link in lane.getOutgoing() if is_pavement(lane) else ():
                if is_pavement(link.getToLane()):
                    parent[root(str(link.getTo().getID()))] = root(name)
    return {name: root(name) for name in sorted(parent)}


def _persons(
    pavements: Sequence[Pavement], volume: Volume, rng: np.random.Generator
) -> Iterator[tuple[float, str]]:
    """Walks from pavement to pavement with their times; those of the beginning first."""
    if not pavements:
        return
    early = _count(volume.persons, pavements, WALK_S)
    later = _count(volume.persons, pavements, volume.duration)
    times = [0.0] * early + _times(later, volume.duration, rng)
    lengths = np.cumsum([p.length for p in pavements])
    for number, time in enumerate(times):
        start = _pavement(pavements, lengths, rng)
        near = [
            p
            for p in pavements
            if p.part == start.part and math.dist(p.middle, start.middle) <= WALK_M
        ]
        end = _pavement(near, np.cumsum([p.length for p in near]), rng)
        yield time, _person(number, time, start, end, rng)


def _pavement(
    pavements: Sequence[Pavement], lengths: np.ndarray[Any, Any], rng: np.random.Generator
) -> Pavement:
    """A pavement, by length; ``lengths`` are summed up."""
    drawn = rng.uniform(0.0, float(lengths[-1]))
    return pavements[min(int(np.searchsorted(lengths, drawn, side="right")), len(pavements) - 1)]


def _person(
    number: int, time: float, start: Pavement, end: Pavement, rng: np.random.Generator
) -> str:
    """The XML of a pedestrian; SUMO finds the way over walking areas and crossings."""
    first, last = (float(rng.uniform(MARGIN_M, p.length - MARGIN_M)) for p in (start, end))
    return (
        f'    <person id="bg_person{number}" depart="{time:.1f}" departPos="{first:.1f}">\n'
        f"        <walk from={quoteattr(start.id)} to={quoteattr(end.id)}"
        f' arrivalPos="{last:.1f}"/>\n'
        "    </person>\n"
    )
