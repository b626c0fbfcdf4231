"""The ego's way through a network: given, or derived through the junction best worth testing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from cavsumo.errors import NetworkError
from cavsumo.network import (
    Network,
    driving_lanes,
    interior,
    is_normal,
    is_pavement,
    lane_path,
)
from cavsumo.paths import Path

APPROACH_M = 80.0  # how far before the junction the ego starts, where the roads allow it
EXIT_M = 50.0  # how far behind the junction it is followed
STRAIGHT, BACK = "s", "tT"  # SUMO's connection directions
YIELDING = "m=sw"  # SUMO's link states without right of way


@dataclass(frozen=True, slots=True)
class EgoRoute:
    """Where the ego drives.

    Attributes:
        edges: ids of its edges.
        lane: index of the lane on which it starts.
        depart_m: where its front bumper starts, from the beginning of the first edge [m].
        arrive_m: where it leaves the simulation, from the beginning of the last edge [m].
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


def derived_route(network: Network, junction_id: str | None, half_m: float) -> EgoRoute:
    """The route best worth testing: over crossings, straight on, well approached; ties by id.

    A network without a junction to drive through gives its longest edge with a pavement.
    """
    nodes = [network.junction(junction_id)] if junction_id else network.net.getNodes()
    crossed = network.crossed_edges()
    ranked = sorted(
        (m for node in nodes for m in _movements(node)), key=lambda m: _worth(m, crossed)
    )
    for movement in ranked:
        try:
            return _through(network, movement, half_m)
        except NetworkError:
            continue  # no chain of lanes along these edges: the next best
    if junction_id:
        raise NetworkError(f"{network.file}: no car can drive through junction {junction_id!r}")
    edge = min(network.edges, key=_dullness)
    return _routed(network, [edge], half_m, half_m, float(edge.getLength()), None)


@dataclass(frozen=True)
class _Movement:
    """One way through a junction."""

    into: Any
    out: Any
    node: Any
    direction: str


def _movements(node: Any) -> list[_Movement]:
    """Each way a car may drive through a junction, once per pair of edges."""
    found: dict[tuple[str, str], _Movement] = {}
    for into in node.getIncoming():
        for lane in driving_lanes(into):
            for link in lane.getOutgoing():
                out, direction = link.getTo(), str(link.getDirection())
                if direction not in BACK and is_normal(into) and driving_lanes(out):
                    found.setdefault(
                        (into.getID(), out.getID()), _Movement(into, out, node, direction)
                    )
    return list(found.values())


def _worth(movement: _Movement, crossed: set[str]) -> tuple[Any, ...]:
    """Sort key: the best movement to test first."""
    into, out = movement.into, movement.out
    before = _upstream(into)
    approach = sum(e.getLength() for e in before)
    return (
        movement.direction != STRAIGHT,
        -sum(e.getID() in crossed for e in (into, out)),
        -sum(any(is_pavement(lane) for lane in e.getLanes()) for e in (into, out)),
        _yields([*before, out]),
        -min(approach, APPROACH_M) // 20,
        -min(out.getLength(), EXIT_M) // 20,
        -len(movement.node.getIncoming()),
        str(into.getID()),
        str(out.getID()),
    )


def _yields(edges: Sequence[Any]) -> int:
    """How many times a car on these edges has to give way."""
    return sum(
        all(link.getState() in YIELDING for link in into.getOutgoing().get(out, []))
        for into, out in pairwise(edges)
    )


def _dullness(edge: Any) -> tuple[Any, ...]:
    """Sort key of a road without a junction: longest with a pavement first."""
    paved = any(is_pavement(lane) for lane in edge.getLanes())
    return (not driving_lanes(edge), not paved, -edge.getLength(), str(edge.getID()))


def _upstream(edge: Any) -> list[Any]:
    """The edge and the edges leading straight to it, until the approach is long enough."""
    return _prolonged(edge, APPROACH_M, lambda e: _straight(e.getIncoming()))[::-1]


def _downstream(edge: Any) -> list[Any]:
    """The edge and the edges leading straight on from it, until the exit is long enough."""
    return _prolonged(edge, EXIT_M, lambda e: _straight(e.getOutgoing()))


def _prolonged(edge: Any, wanted: float, onward: Callable[[Any], list[Any]]) -> list[Any]:
    """Edges one after another until they are long enough together or the road ends."""
    chain = [edge]
    while sum(e.getLength() for e in chain) < wanted:
        candidates = [e for e in onward(chain[-1]) if e not in chain]
        if not candidates:
            break
        chain.append(max(candidates, key=lambda e: (e.getLength(), str(e.getID()))))
    return chain


def _straight(connections: dict[Any, list[Any]]) -> list[Any]:
    """The neighbouring edges that a car reaches by driving straight on."""
    return [
        edge
        for edge, links in connections.items()
        if driving_lanes(edge) and any(link.getDirection() == STRAIGHT for link in links)
    ]


def _through(network: Network, movement: _Movement, half_m: float) -> EgoRoute:
    """The route through a junction, cut to the approach and the exit wanted."""
    before, after = _upstream(movement.into), _downstream(movement.out)
    while len(before) > 1 and _driven(network, before) - APPROACH_M >= before[0].getLength() - 1.0:
        before.pop(0)
    depart = max(half_m, _driven(network, before) - APPROACH_M)
    surplus = sum(e.getLength() for e in after) - EXIT_M
    arrive = max(1.0, float(after[-1].getLength()) - max(0.0, surplus))
    return _routed(network, [*before, *after], half_m, depart, arrive, str(movement.node.getID()))


def _driven(network: Network, edges: Sequence[Any]) -> float:
    """Length of the way over some edges, junction interiors included [m]; 0 when there is none."""
    lanes = _lanes_along(network, edges)
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
    lanes = _lanes_along(network, edges)
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


def _lanes_along(network: Network, edges: Sequence[Any]) -> list[Any] | None:
    """Lanes that follow each other along the edges, junction interiors included, or None."""
    for lane in driving_lanes(edges[0]):
        chain = _chain(network, lane, edges[1:])
        if chain is not None:
            return chain
    return None


def _chain(network: Network, lane: Any, onward: Sequence[Any]) -> list[Any] | None:
    """Depth-first search for lanes from this one over the edges that follow."""
    if not onward:
        return [lane]
    for link in lane.getOutgoing():
        target = link.getToLane()
        if link.getTo() is not onward[0] or not target.allows("passenger"):
            continue
        rest = _chain(network, target, onward[1:])
        if rest is not None:
            return [lane, *interior(network, link), *rest]
    return None
