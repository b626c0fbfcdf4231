"""The junctions of a network that are worth testing, and the ways through them, as records."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import shapely
from shapely.geometry import LineString

from cavsumo.ego_routes import EgoRoute, Movement, movements, ranked_movements, route_through
from cavsumo.errors import NetworkError
from cavsumo.facts import place
from cavsumo.network import Network, is_normal, lane_shape
from cavsumo.roads import Roads
from cavsumo.starts import StartingArea, starting_areas

TURNS = ("straight", "left", "right", "u-turn")
ATTEMPTS = 50  # routes that are tried in search of the junctions that testers reach


@dataclass(frozen=True)
class Way:
    """One way of the ego through a junction.

    Attributes:
        turn: straight, left, right or u-turn.
        into, out: ids of the edges that meet at the junction.
        streets: their names, as far as they have any.
        route: where the ego drives.
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
        return sum(area.end - area.begin for area in self.areas)


@dataclass(frozen=True)
class Junction:
    """A junction through which the ego can drive.

    Attributes:
        id, type: SUMO's.
        x, y: where it is [m].
        centre: its latitude and longitude [degrees], None when not known.
        streets: names of the roads that meet there.
        crossings: how many pedestrian crossings it has.
        ways: through it, the best first, U-turns last.
    """

    id: str
    type: str
    x: float
    y: float
    centre: tuple[float, float] | None
    streets: tuple[str, ...]
    crossings: int
    ways: tuple[Way, ...]


@dataclass(frozen=True)
class Ground:
    """What every look at a junction needs.

    Attributes:
        network: with its junctions.
        roads: its carriageways.
        half_m: half the ego's length [m].
        crossings: ids of the pedestrian crossings, in the order of
        lines: the index of their axes.
    """

    network: Network
    roads: Roads
    half_m: float
    crossings: tuple[str, ...]
    lines: shapely.STRtree


def ground(network: Network, half_m: float) -> Ground:
    """Prepare a network for a look at its junctions; ValueError for lanes without a shape."""
    lanes = [(str(edge.getID()), edge.getLanes()[0]) for edge in network.crossings()]
    lines = shapely.STRtree([LineString(lane_shape(lane)) for _, lane in lanes])
    return Ground(network, network.roads(), half_m, tuple(name for name, _ in lanes), lines)


def best_junctions(here: Ground, top: int) -> list[Junction]:
    """The junctions best worth testing, those where testers can meet the ego before the others.

    The first is the one that ``cavsumo run`` chooses.
    """
    reached: dict[str, Any] = {}
    others: dict[str, Any] = {}
    tried = 0
    for movement in ranked_movements(here.network):
        key = str(movement.node.getID())
        if len(reached) >= top or (tried >= ATTEMPTS and len(reached) + len(others) >= top):
            break
        route = None if key in reached else route_through(here.network, movement, here.half_m)
        if route is not None:
            tried += 1
            meets = tried <= ATTEMPTS and _areas(here, route)
            (reached if meets else others).setdefault(key, movement.node)
    nodes = list({**reached, **others}.values())[:top]
    return [junction(here, node) for node in nodes]


def junction(here: Ground, node: Any) -> Junction:
    """A junction with all ways through it; those where testers meet the ego come first."""
    network = here.network
    x, y = (float(value) for value in node.getCoord()[:2])
    back = [movement for movement in movements(node) if movement.turn == TURNS[-1]]
    ways = [_way(here, m) for m in [*ranked_movements(network, str(node.getID())), *back]]
    return Junction(
        id=str(node.getID()),
        type=str(node.getType()),
        x=x,
        y=y,
        centre=place(network, x, y),
        streets=_streets([*node.getIncoming(), *node.getOutgoing()]),
        crossings=sum(crossing.getFromNode() is node for crossing in network.crossings()),
        ways=tuple(sorted((way for way in ways if way is not None), key=lambda w: not w.areas)),
    )


def _way(here: Ground, movement: Movement) -> Way | None:
    """A movement with its route and whom it meets; None when no lanes lead along it."""
    route = route_through(here.network, movement, here.half_m)
    if route is None:
        return None
    met = here.lines.query(LineString(route.path.points), "intersects").tolist()
    return Way(
        turn=movement.turn,
        into=str(movement.into.getID()),
        out=str(movement.out.getID()),
        streets=(str(movement.into.getName() or ""), str(movement.out.getName() or "")),
        route=route,
        crossings=tuple(here.crossings[i] for i in sorted(met)),
        areas=_areas(here, route),
    )


def _areas(here: Ground, route: EgoRoute) -> tuple[StartingArea, ...]:
    """Where testers start that meet a route, none where there is no pavement."""
    try:
        return starting_areas(here.network, here.roads, route.path)
    except NetworkError:
        return ()


def _streets(edges: Iterable[Any]) -> tuple[str, ...]:
    """The names of roads, each once, in order."""
    return tuple(sorted({str(e.getName()) for e in edges if is_normal(e) and e.getName()}))
