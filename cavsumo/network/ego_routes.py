"""The ego's route through a network: given, or derived through the most suitable junction."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from cavsumo.errors import NetworkError, UnknownName
from cavsumo.model.polyline import Path
from cavsumo.network.movements import (
    APPROACH_M,
    EXIT_M,
    TURNS,
    Movement,
    downstream,
    movements,
    ranked_movements,
    upstream,
    worth,
)
from cavsumo.network.reader import (
    Network,
    driving_lanes,
    interior,
    is_pavement,
    lane_path,
)


@dataclass(frozen=True, slots=True)
class EgoRoute:
    """The route of the ego.

    Attributes:
        edges: ids of its edges.
        lane: index of the lane on which it starts.
        depart_m: start position of its front bumper on the first edge [m].
        arrive_m: position on the last edge at which it leaves the simulation [m].
        path: its centre line from where the ego's centre starts to where its front arrives.
        junction: id of the junction under test, None when there is none or the route was given.
    """

    edges: tuple[str, ...]
    lane: int
    depart_m: float
    arrive_m: float
    path: Path
    junction: str | None = None


def given_route(network: Network, edge_ids: Sequence[str], half_m: float) -> EgoRoute:
    """The route over the edges named, from the beginning of the first to the end of the last.

    ``half_m`` is half the ego's length: its centre starts at the beginning of the first edge.
    """
    edges = [network.edge(i) for i in edge_ids]
    return _routed(network, edges, half_m, half_m, float(edges[-1].getLength()), None)


def derived_routes(network: Network, junction_id: str | None, half_m: float) -> Iterator[EgoRoute]:
    """The routes suited to tests, the best first; raises NetworkError when there is none.

    A network without a junction to drive through gives its longest edge with a pavement.
    """
    none = True
    for _, route in ranked_routes(network, junction_id, half_m):
        none = False
        yield route
    if none and junction_id:
        raise NetworkError(f"{network.file}: no car can drive through junction {junction_id!r}")
    if none:
        edge = min(network.edges, key=_dullness)
        yield _routed(network, [edge], half_m, half_m, float(edge.getLength()), None)


def turn_meant(network: Network, words: Sequence[str]) -> str | None:
    """The turn that a route of one word names; None for edges, which take precedence."""
    if len(words) != 1 or any(words[0] == e.getID() for e in network.edges):
        return None
    if words[0] not in TURNS:
        valid = [*TURNS, *(str(e.getID()) for e in network.edges)]
        raise UnknownName("edge or turn", words[0], valid, str(network.file))
    return words[0]


def turning_routes(
    network: Network, junction_id: str | None, half_m: float, turn: str
) -> Iterator[EgoRoute]:
    """The routes that take a turn at a junction, the best first.

    Raises NetworkError when there is none, with the turns that there are.
    """
    if junction_id is None:
        raise NetworkError(f"{network.file}: has no junction with a way {turn!r} for the ego")
    found: dict[str, list[EgoRoute]] = {}
    crossed = network.crossed_edges()
    ways = movements(network.junction(junction_id))
    for movement in sorted(ways, key=lambda m: worth(m, crossed)):
        route = route_through(network, movement, half_m)
        if route is not None:
            found.setdefault(movement.turn, []).append(route)
    if turn not in found:
        known = ", ".join(t for t in TURNS if t in found) or "none"
        raise NetworkError(
            f"{network.file}: no way {turn!r} for the ego through junction {junction_id!r}; "
            f"the ways there: {known}"
        )
    yield from found[turn]


def ranked_routes(
    network: Network, junction_id: str | None, half_m: float
) -> Iterator[tuple[Movement, EgoRoute]]:
    """The ways through a junction, or through all, with their routes, the best first.

    Where roads overlap on the map, netconvert makes lanes that lead back to the beginning of the
    next one; routes along such a zigzag come last.
    """
    zigzags: list[tuple[Movement, EgoRoute]] = []
    for movement in ranked_movements(network, junction_id):
        route = route_through(network, movement, half_m)
        if route is not None and _turns_back(route.path):
            zigzags.append((movement, route))
        elif route is not None:
            yield movement, route
    yield from zigzags


def _dullness(edge: Any) -> tuple[Any, ...]:
    """Sort key of a road without a junction: longest with a pavement first."""
    paved = any(is_pavement(lane) for lane in edge.getLanes())
    return (not driving_lanes(edge), not paved, -edge.getLength(), str(edge.getID()))


def route_through(network: Network, movement: Movement, half_m: float) -> EgoRoute | None:
    """The route through a junction, cut to the approach and the exit wanted.

    None when no chain of lanes leads along its edges.
    """
    before, after = upstream(movement.into), downstream(movement.out)
    while len(before) > 1 and _driven(network, before) - APPROACH_M >= before[0].getLength() - 1.0:
        before.pop(0)
    depart = max(half_m, _driven(network, before) - APPROACH_M)
    surplus = math.fsum(e.getLength() for e in after) - EXIT_M
    arrive = max(1.0, float(after[-1].getLength()) - max(0.0, surplus))
    try:
        edges = [*before, *after]
        return _routed(network, edges, half_m, depart, arrive, str(movement.node.getID()))
    except NetworkError:
        return None


def _turns_back(path: Path) -> bool:
    """Whether a path has a corner in which it goes back."""
    legs = [(q[0] - p[0], q[1] - p[1]) for p, q in pairwise(path.points)]
    return any(a[0] * b[0] + a[1] * b[1] < 0.0 for a, b in pairwise(legs))


def _driven(network: Network, edges: Sequence[Any]) -> float:
    """Length of the way over some edges, junction interiors included [m]; 0 when there is none."""
    lanes = lanes_along(network, edges)
    return lane_path(lanes).length if lanes else 0.0


def _routed(
    network: Network,
    edges: Sequence[Any],
    half_m: float,
    depart: float,
    arrive: float,
    junction: str | None,
) -> EgoRoute:
    """The route over these edges, with the lanes that a car can follow."""
    for edge in edges:
        if not driving_lanes(edge):
            raise NetworkError(f"{network.file}: no car may drive on edge {edge.getID()!r}")
    lanes = lanes_along(network, edges)
    if lanes is None:
        names = " ".join(str(e.getID()) for e in edges)
        raise NetworkError(f"{network.file}: no car can follow the route {names}")
    line = lane_path(lanes)
    end = line.length - max(0.0, float(edges[-1].getLength()) - arrive)
    if end - depart < 1.0:
        raise NetworkError(f"{network.file}: the ego's route is shorter than the ego")
    return EgoRoute(
        edges=tuple(str(e.getID()) for e in edges),
        lane=int(lanes[0].getIndex()),
        depart_m=round(depart, 2),
        arrive_m=round(arrive, 2),
        path=line.cut(depart - half_m, end),
        junction=junction,
    )


def lanes_along(network: Network, edges: Sequence[Any]) -> list[Any] | None:
    """Lanes that follow each other along the edges, junction interiors included, or None."""
    for lane in driving_lanes(edges[0]):
        chain = lanes_from(network, lane, edges[1:])
        if chain is not None:
            return chain
    return None


def lanes_from(network: Network, lane: Any, onward: Sequence[Any]) -> list[Any] | None:
    """Depth-first search for lanes from this one over the edges that follow."""
    if not onward:
        return [lane]
    for link in lane.getOutgoing():
        target = link.getToLane()
        if link.getTo() is not onward[0] or not target.allows("passenger"):
            continue
        rest = lanes_from(network, target, onward[1:])
        if rest is not None:
            return [lane, *interior(network, link), *rest]
    return None
