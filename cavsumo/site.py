"""Where a test takes place: what was derived from the network, ready for every episode.

A plain picklable record, derived once by the parent and handed to the processes that simulate.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import shapely

from cavsumo.ego_routes import EgoRoute, derived_routes, given_route
from cavsumo.errors import NetworkError
from cavsumo.network import Network, read_network
from cavsumo.roads import Roads
from cavsumo.starts import StartingArea, starting_areas

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
    """

    net: Path
    route: EgoRoute
    roads: Roads
    areas: tuple[StartingArea, ...]
    crossings: shapely.Geometry


def derive_site(
    net: Path, ego_route: tuple[str, ...], junction: str | None, ego_length: float
) -> Site:
    """Read a network and derive the ego's route and the testers' starting areas.

    Raises InputError (UnknownName, NetworkError) in one sentence.
    """
    network = read_network(net)
    try:
        return _derived(network, ego_route, junction, ego_length)
    except ValueError as error:  # shapes without points, widths that are none
        raise NetworkError(f"network {str(net)!r}: {error}") from error


def _derived(
    network: Network, ego_route: tuple[str, ...], junction: str | None, ego_length: float
) -> Site:
    """The site of a network that was read."""
    half, roads = ego_length / 2, network.roads()
    if ego_route:
        route = given_route(network, ego_route, half)
        areas = starting_areas(network, roads, route.path)
    else:
        route, areas = best_route(network, roads, junction, half)
    return Site(network.file, route, roads, areas, network.crossing_surface())


def best_route(
    network: Network, roads: Roads, junction: str | None, half_m: float
) -> tuple[EgoRoute, tuple[StartingArea, ...]]:
    """The best-ranked route that testers can reach, and where they start.

    ``half_m`` is half the ego's length. Raises the NetworkError of the first route when testers
    reach none.
    """
    first: NetworkError | None = None
    for route in islice(derived_routes(network, junction, half_m), ATTEMPTS):
        try:
            return route, starting_areas(network, roads, route.path)
        except NetworkError as error:
            first = first or error
    assert first is not None
    raise first
