"""The junctions of a network that are suited to tests, and the ways through them, as records."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import shapely
from shapely.geometry import LineString

from cavsumo.errors import NetworkError
from cavsumo.model.carriageway import Roads
from cavsumo.network.ego_routes import EgoRoute, ranked_routes, route_through
from cavsumo.network.facts import place
from cavsumo.network.intersections import Pieces, intersections
from cavsumo.network.movements import Movement, movements
from cavsumo.network.pedestrian_starts import StartingArea, WaysAcross, starting_areas
from cavsumo.network.reader import Network, is_normal, lane_shape, street

ATTEMPTS = 50  # routes that are tried in search of the junctions that testers reach


@dataclass(frozen=True)
class Way:
    """One way of the ego through a junction.

    Attributes:
        turn: straight, left, right or u-turn.
        into, out: ids of the edges that meet at the junction.
        streets: their names, as far as they have any.
        route: the ego's route.
        crossings: ids of the pedestrian crossings that its path leads over.
        areas: where testers may start.
    """

    turn: str
    into: str
    out: str
    streets: tuple[str, str]
    route: EgoRoute
    crossings: tuple[str, ...]
    areas: tuple[StartingArea, ...]

    @property
    def area_m(self) -> float:
        """Length of all starting areas together [m]."""
        return math.fsum(area.end - area.begin for area in self.areas)


@dataclass(frozen=True)
class Junction:
    """A junction through which the ego can drive.

    Attributes:
        id, type: SUMO's.
        x, y: where it is [m].
        centre: its latitude and longitude [degrees], None when not known.
        pieces: ids of all junctions of the intersection that it is a piece of, itself among them.
        streets: names of the roads that meet there, at any of the pieces.
        crossings: how many pedestrian crossings the pieces have.
        ways: through it, the best first, U-turns last.
    """

    id: str
    type: str
    x: float
    y: float
    centre: tuple[float, float] | None
    pieces: tuple[str, ...]
    streets: tuple[str, ...]
    crossings: int
    ways: tuple[Way, ...]


@dataclass(frozen=True)
class InspectedNetwork:
    """The data that the inspection of every junction needs.

    Attributes:
        network: with its junctions.
        roads: its carriageways.
        half_m: half the ego's length [m].
        crossings: ids of the pedestrian crossings, in the order of
        lines: the index of their axes.
        ways: ways across the road that were found.
    """

    network: Network
    roads: Roads
    half_m: float
    crossings: tuple[str, ...]
    lines: shapely.STRtree
    ways: WaysAcross = field(default_factory=dict)

    @cached_property
    def pieces(self) -> Pieces:
        """For every junction the pieces of its intersection."""
        return intersections(self.network)


def ground(network: Network, half_m: float) -> InspectedNetwork:
    """Prepare a network for the inspection of junctions; ValueError for lanes without a shape."""
    lanes = [(str(edge.getID()), edge.getLanes()[0]) for edge in network.crossings()]
    lines = shapely.STRtree([LineString(lane_shape(lane)) for _, lane in lanes])
    return InspectedNetwork(
        network, network.roads(), half_m, tuple(name for name, _ in lanes), lines
    )


def best_junctions(here: InspectedNetwork, top: int) -> list[Junction]:
    """The junctions most suited to tests; those where testers can meet the ego come first.

    The first is the one that ``cavsumo run`` chooses. Of the pieces of one intersection only the
    best is there.
    """
    pieces = here.pieces
    reached: dict[str, Any] = {}
    others: dict[str, Any] = {}
    tried = 0
    for movement, route in ranked_routes(here.network, None, here.half_m):
        key = pieces[str(movement.node.getID())][0]
        if len(reached) >= top or (tried >= ATTEMPTS and len(reached) + len(others) >= top):
            break
        if key not in reached:
            tried += 1
            meets = tried <= ATTEMPTS and _areas(here, route)
            (reached if meets else others).setdefault(key, movement.node)
    found = [*reached.values(), *(node for key, node in others.items() if key not in reached)]
    return [junction(here, node) for node in found[:top]]


def junction(here: InspectedNetwork, node: Any) -> Junction:
    """A junction with all ways through it; those where testers meet the ego come first."""
    network = here.network
    x, y = (float(value) for value in node.getCoord()[:2])
    pieces = here.pieces[str(node.getID())]
    nodes = [network.junction(piece) for piece in pieces]
    ranked = list(ranked_routes(network, str(node.getID()), here.half_m))
    for movement in movements(node):
        route = route_through(network, movement, here.half_m) if movement.turns_back else None
        ranked += [(movement, route)] if route is not None else []
    ways = [_way(here, movement, route) for movement, route in ranked]
    return Junction(
        id=str(node.getID()),
        type=str(node.getType()),
        x=x,
        y=y,
        centre=place(network, x, y),
        pieces=pieces,
        streets=_streets(edge for n in nodes for edge in (*n.getIncoming(), *n.getOutgoing())),
        crossings=sum(crossing.getFromNode() in nodes for crossing in network.crossings()),
        ways=tuple(sorted(ways, key=lambda way: not way.areas)),
    )


def _way(here: InspectedNetwork, movement: Movement, route: EgoRoute) -> Way:
    """A movement with its route and the starting areas that it meets."""
    met = here.lines.query(LineString(route.path.points), "intersects").tolist()
    return Way(
        turn=movement.turn,
        into=str(movement.into.getID()),
        out=str(movement.out.getID()),
        streets=(street(movement.into), street(movement.out)),
        route=route,
        crossings=tuple(here.crossings[i] for i in sorted(met)),
        areas=_areas(here, route),
    )


def _areas(here: InspectedNetwork, route: EgoRoute) -> tuple[StartingArea, ...]:
    """The starting areas of testers that meet a route, none without a pavement."""
    try:
        return starting_areas(here.network, here.roads, route.path, here.ways)
    except NetworkError:
        return ()


def _streets(edges: Iterable[Any]) -> tuple[str, ...]:
    """The names of roads, each once, in order."""
    return tuple(sorted({street(e) for e in edges if is_normal(e) and e.getName()}))
