"""Where a test takes place: what was derived from the network, ready for every episode.

A plain picklable record, derived once by the parent and handed to the processes that simulate.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

import shapely

from cavsumo.ego_routes import EgoRoute, derived_routes, given_route, turn_meant, turning_routes
from cavsumo.errors import NetworkError
from cavsumo.kerbs import kerb_areas
from cavsumo.network import Network, read_network
from cavsumo.roads import Roads
from cavsumo.signals import LightStart, Pace, Signal, light_start
from cavsumo.starts import StartingArea, starting_areas
from cavsumo.traffic import Volume, background

ATTEMPTS = 50  # routes that are tried before a network is refused


@dataclass(frozen=True)
class Site:
    """A network as one scenario uses it.

    Attributes:
        net: the network file.
        route: the ego's route.
        roads: carriageways and the ways across them.
        areas: where the testers may start.
        crossings: the surface of the marked crossings.
        demand: background traffic drawn for it, as the text of a route file; None for none.
        light: how the first traffic light on the ego's route begins an episode; None for as it is.
    """

    net: Path
    route: EgoRoute
    roads: Roads
    areas: tuple[StartingArea, ...]
    crossings: shapely.Geometry
    demand: str | None = None
    light: LightStart | None = None


@dataclass(frozen=True)
class Wishes:
    """What a scenario may ask of its site besides the route.

    Attributes:
        jaywalk: testers start anywhere beside the road, not on pavements only.
        volume: the background traffic to draw.
        signal: the colour that the ego meets at the first traffic light.
        pace: how fast the ego comes there.
    """

    jaywalk: bool = False
    volume: Volume | None = None
    signal: Signal = "any"
    pace: Pace = field(default_factory=Pace)


def derive_site(
    net: Path,
    ego_route: tuple[str, ...],
    junction: str | None,
    ego_length: float,
    wishes: Wishes = Wishes(),
) -> Site:
    """Read a network and derive the ego's route and the testers' starting areas.

    ``ego_route`` are edges, or one word for a turn. Raises InputError (UnknownName, NetworkError)
    in one sentence.
    """
    network = read_network(net)
    try:
        return _derived(network, ego_route, junction, ego_length, wishes)
    except ValueError as error:  # shapes without points, widths that are none
        raise NetworkError(f"network {str(net)!r}: {error}") from error


def _derived(
    network: Network,
    ego_route: tuple[str, ...],
    junction: str | None,
    ego_length: float,
    wishes: Wishes,
) -> Site:
    """The site of a network that was read."""
    half, roads = ego_length / 2, network.roads()
    turn, jaywalk = turn_meant(network, ego_route), wishes.jaywalk
    if turn:
        node = junction or best_route(network, roads, None, half, jaywalk)[0].junction
        turning = turning_routes(network, node, half, turn)
        route, areas = _first_met(network, roads, turning, jaywalk)
    elif ego_route:
        route = given_route(network, ego_route, half)
        areas = areas_along(network, roads, route, jaywalk)
    else:
        route, areas = best_route(network, roads, junction, half, jaywalk)
    return Site(
        network.file,
        route,
        roads,
        areas,
        network.crossing_surface(),
        background(network, route, wishes.volume) if wishes.volume else None,
        light_start(network, route, wishes.signal, wishes.pace),
    )


def best_route(
    network: Network,
    roads: Roads,
    junction: str | None,
    half_m: float,
    jaywalk: bool = False,
) -> tuple[EgoRoute, tuple[StartingArea, ...]]:
    """The best-ranked route that testers can reach, and where they start.

    ``half_m`` is half the ego's length. Raises the NetworkError of the first route when testers
    reach none.
    """
    return _first_met(network, roads, derived_routes(network, junction, half_m), jaywalk)


def areas_along(
    network: Network, roads: Roads, route: EgoRoute, jaywalk: bool
) -> tuple[StartingArea, ...]:
    """Where testers start that can meet the ego on a route; raises NetworkError for nowhere."""
    find = kerb_areas if jaywalk else starting_areas
    return find(network, roads, route.path)


def _first_met(
    network: Network, roads: Roads, routes: Iterator[EgoRoute], jaywalk: bool
) -> tuple[EgoRoute, tuple[StartingArea, ...]]:
    """The first of the routes that testers can reach, and where they start."""
    first: NetworkError | None = None
    for route in islice(routes, ATTEMPTS):
        try:
            return route, areas_along(network, roads, route, jaywalk)
        except NetworkError as error:
            first = first or error
    assert first is not None
    raise first
