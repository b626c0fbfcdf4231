"""Where a test takes place: what was derived from the network, ready for every episode.

A plain picklable record, derived once by the parent and handed to the processes that simulate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely

from cavsumo.approaches import approaches
from cavsumo.bodies import WALKING, Kind
from cavsumo.ego_routes import EgoRoute, derived_route, given_route
from cavsumo.errors import NetworkError
from cavsumo.geometry import Box
from cavsumo.network import Network, read_network
from cavsumo.roads import Approach, Roads, Start
from cavsumo.starts import StartingArea, draw_starts, starting_areas
from cavsumo.vehicle_starts import draw_vehicles


@dataclass(frozen=True)
class Site:
    """A network as one scenario uses it.

    Attributes:
        net: the network file.
        route: the ego's route.
        roads: carriageways and the ways across them.
        areas: where testers on foot may start.
        crossings: the surface of the marked crossings.
        approaches: the ways on which tester vehicles may meet the ego; none for testers on foot.
    """

    net: Path
    route: EgoRoute
    roads: Roads
    areas: tuple[StartingArea, ...]
    crossings: shapely.Geometry
    approaches: tuple[Approach, ...] = ()

    def draw(
        self, kinds: Sequence[Kind], ego: Kind, start_speed: float | None, rng: np.random.Generator
    ) -> tuple[Start, ...]:
        """One start for each tester's body; consumes the generator."""
        if not self.approaches:
            return draw_starts(self.areas, kinds, rng)
        box = Box(*self.route.path.at(0.0), ego.length, ego.width)
        return draw_vehicles(self.approaches, kinds, box, start_speed, rng)


def derive_site(
    net: Path,
    ego_route: tuple[str, ...],
    junction: str | None,
    ego: Kind,
    kind: Kind,
    types: tuple[str, ...] = (),
) -> Site:
    """Read a network and derive the ego's route and where testers of a kind start.

    ``types`` are the types of approach wanted of vehicles, all if it is empty. Raises
    InputError (UnknownName, NetworkError) in one sentence.
    """
    network = read_network(net)
    try:
        route = _route(network, ego_route, junction, ego.length / 2)
        roads, crossings = network.roads(), network.crossing_surface()
        if kind.name in WALKING:
            areas = starting_areas(network, roads, route.path)
            return Site(net, route, roads, areas, crossings)
        ways = approaches(network, route, ego, kind, types)
        return Site(net, route, roads, (), crossings, ways)
    except ValueError as error:  # shapes without points, widths that are none
        raise NetworkError(f"network {str(net)!r}: {error}") from error


def _route(
    network: Network, ego_route: tuple[str, ...], junction: str | None, half: float
) -> EgoRoute:
    """The ego's route, given or derived."""
    if ego_route:
        return given_route(network, ego_route, half)
    return derived_route(network, junction, half)
