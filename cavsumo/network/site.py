"""The place of a test: all data derived from the network, ready for every episode.

A plain picklable record, derived once by the parent and sent to the simulating processes.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import TypeVar

import numpy as np
import shapely
from shapely.geometry import LineString

from cavsumo.errors import NetworkError
from cavsumo.model.bodies import PEDESTRIAN, WALKING, Body, Kind
from cavsumo.model.carriageway import Approach, Light, Limit, MarkedCrossing, Roads, Start
from cavsumo.model.geometry import Box
from cavsumo.model.scene import Scene
from cavsumo.model.stopping_way import is_clear
from cavsumo.model.vocabulary import Signal
from cavsumo.network.approaches import approaches
from cavsumo.network.ego_routes import (
    EgoRoute,
    derived_routes,
    given_route,
    turn_meant,
    turning_routes,
)
from cavsumo.network.jaywalk_starts import kerb_areas
from cavsumo.network.pedestrian_starts import (
    StartingArea,
    clear_starts,
    draw_starts,
    room,
    starting_areas,
)
from cavsumo.network.reader import Network, read_network
from cavsumo.network.route_rules import crossings_along, limits_along
from cavsumo.network.traffic import Volume, background
from cavsumo.network.traffic_lights import LightStart, Pace, light_start, lights_along
from cavsumo.network.vehicle_starts import draw_vehicles

GROUND_M = 100.0  # the ground is told so far from the ego's path
ATTEMPTS = 50  # routes that are tried before a network is refused
Where = TypeVar("Where")  # from where testers meet the ego: areas or approaches


@dataclass(frozen=True)
class Site:
    """A network as one scenario uses it.

    Attributes:
        net: the network file.
        route: the ego's route.
        roads: carriageways and the ways across them.
        areas: starting areas of tester pedestrians.
        crossings: the surface of the marked crossings.
        demand: background traffic drawn for it, as the text of a route file; None for none.
        light: initial state of the first traffic light on the ego's route; None to keep SUMO's.
        approaches: the ways on which tester vehicles may meet the ego; none for pedestrians.
        lights: the traffic lights on the ego's route.
        marked: the marked pedestrian crossings on the ego's route.
        limits: the speed limits on the ego's route.
        ground: the areas for walking or driving near the route, if pedestrians must stay on it.
    """

    net: Path
    route: EgoRoute
    roads: Roads
    areas: tuple[StartingArea, ...]
    crossings: shapely.Geometry
    demand: str | None = None
    light: LightStart | None = None
    approaches: tuple[Approach, ...] = ()
    lights: tuple[Light, ...] = ()
    marked: tuple[MarkedCrossing, ...] = ()
    limits: tuple[Limit, ...] = ()
    ground: shapely.Geometry | None = None

    def draw(
        self, kinds: Sequence[Kind], ego: Kind, start_speed: float | None, rng: np.random.Generator
    ) -> tuple[Start, ...]:
        """One start for each tester's body; consumes the generator."""
        if not self.approaches:
            return draw_starts(self.areas, kinds, rng)
        box = Box(*self.route.path.at(0.0), ego.length, ego.width)
        return draw_vehicles(self.approaches, kinds, box, start_speed, rng)

    def blocked(self, kinds: Sequence[Kind], starts: Sequence[Start], taken: Sequence[Box]) -> bool:
        """Whether a body stands at or right before the start of a tester on a pavement."""
        drawn = [(s, kind) for s, kind in zip(starts, kinds, strict=True) if s.pavement]
        return not all(is_clear(room(start, kind), taken) for start, kind in drawn)

    def cleared(
        self,
        kinds: Sequence[Kind],
        starts: Sequence[Start],
        taken: Sequence[Box],
        rng: np.random.Generator,
    ) -> tuple[Start, ...]:
        """The starts of tester pedestrians, with blocked starts drawn again.

        Consumes the generator. Raises NetworkError when there is no room.
        """
        return clear_starts(self.areas, kinds, starts, taken, rng)

    def scene(
        self, dt: float, ego: Body, bodies: Sequence[Body], starts: Sequence[Start], seed: int
    ) -> Scene:
        """The constant part of an episode at this site."""
        return Scene(
            dt=dt,
            ego=ego,
            ego_path=self.route.path,
            bodies=tuple(bodies),
            starts=tuple(starts),
            roads=self.roads,
            lights=self.lights,
            seed=seed,
            crossings=self.marked,
            limits=self.limits,
            ground=self.ground,
        )


@dataclass(frozen=True)
class Wishes:
    """The requirements of a scenario on its site besides the route.

    Attributes:
        kind: of the testers.
        types: of the approaches on which tester vehicles start; all if it is empty.
        jaywalk: testers start anywhere beside the road, not on pavements only.
        volume: the background traffic to draw.
        signal: the colour that the ego meets at the first traffic light.
        pace: the speed at which the ego arrives there.
    """

    kind: Kind = PEDESTRIAN
    types: tuple[str, ...] = ()
    jaywalk: bool = False
    volume: Volume | None = None
    signal: Signal = "any"
    pace: Pace = field(default_factory=Pace)


def derive_site(
    net: Path,
    ego_route: tuple[str, ...],
    junction: str | None,
    ego: Kind,
    wishes: Wishes = Wishes(),
) -> Site:
    """Read a network and derive the ego's route and the starts of testers.

    ``ego_route`` is a list of edges, or one word for a turn. Raises InputError (UnknownName,
    NetworkError) in one sentence.
    """
    with uncollected():
        network = read_network(net, foes=wishes.kind.name not in WALKING)
        try:
            return _derived(network, ego_route, junction, ego, wishes)
        except ValueError as error:  # shapes without points, widths that are none
            raise NetworkError(f"network {str(net)!r}: {error}") from error


@contextmanager
def uncollected() -> Iterator[None]:
    """Collect no garbage meanwhile: a large network has many objects, and all of them stay."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()


def _derived(
    network: Network,
    ego_route: tuple[str, ...],
    junction: str | None,
    ego: Kind,
    wishes: Wishes,
) -> Site:
    """The site of a network that was read."""
    roads = network.roads()
    areas: tuple[StartingArea, ...] = ()
    ways: tuple[Approach, ...] = ()

    def on_foot(route: EgoRoute) -> tuple[StartingArea, ...]:
        find = kerb_areas if wishes.jaywalk else starting_areas
        return find(network, roads, route.path)

    def by_road(route: EgoRoute) -> tuple[Approach, ...]:
        return approaches(network, route, ego, wishes.kind, wishes.types)

    walks_on_pavements = wishes.kind.name in WALKING and not wishes.jaywalk
    if wishes.kind.name in WALKING:
        route, areas = _route(network, ego_route, junction, ego.length / 2, on_foot)
    else:
        route, ways = _route(network, ego_route, junction, ego.length / 2, by_road)
    return Site(
        network.file,
        route,
        roads,
        areas,
        network.crossing_surface(),
        background(network, route, wishes.volume) if wishes.volume else None,
        light_start(network, route, wishes.signal, wishes.pace),
        ways,
        lights_along(network, route),
        crossings_along(network, route),
        limits_along(network, route),
        network.ground(LineString(route.path.points), GROUND_M) if walks_on_pavements else None,
    )


def _route(
    network: Network,
    ego_route: tuple[str, ...],
    junction: str | None,
    half_m: float,
    met: Callable[[EgoRoute], Where],
) -> tuple[EgoRoute, Where]:
    """The ego's route, given or the best on which testers can meet it, and their starting areas.

    ``half_m`` is half the ego's length.
    """
    turn = turn_meant(network, ego_route)
    if ego_route and not turn:
        route = given_route(network, ego_route, half_m)
        return route, met(route)
    routes = derived_routes(network, junction, half_m)
    if turn:
        node = junction or _first_met(routes, met)[0].junction
        routes = turning_routes(network, node, half_m, turn)
    return _first_met(routes, met)


def best_route(
    network: Network, roads: Roads, junction: str | None, half_m: float
) -> tuple[EgoRoute, tuple[StartingArea, ...]]:
    """The best-ranked route that pedestrians can reach, and their starting areas.

    ``half_m`` is half the ego's length. Raises the NetworkError of the first route when testers
    reach none.
    """
    routes = derived_routes(network, junction, half_m)
    return _first_met(routes, lambda route: starting_areas(network, roads, route.path))


def _first_met(
    routes: Iterator[EgoRoute], met: Callable[[EgoRoute], Where]
) -> tuple[EgoRoute, Where]:
    """The first of the routes on which testers can meet the ego, and their starting areas."""
    first: NetworkError | None = None
    for route in islice(routes, ATTEMPTS):
        try:
            return route, met(route)
        except NetworkError as error:
            first = first or error
    assert first is not None
    raise first
