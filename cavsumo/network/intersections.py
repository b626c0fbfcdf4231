"""The junctions of a network that are pieces of one intersection, as where dual carriageways cross.

SUMO has a junction at every meeting of edges, so that the crossing of two dual carriageways is four
of them, a few metres apart. Two junctions are pieces of one intersection if an edge shorter than
SHORT_M connects them and one of these holds:

* it is shorter than TOUCHING_M and no other road begins at one end (a crossing beside a junction),
* one traffic light controls both, or
* carriageways of one road cross it at its two ends in opposite directions, or
* the same streets, two or more, meet at both.

So two side streets that leave a road close to each other stay two intersections. No intersection
becomes wider than WIDEST_M: short edges may follow each other along a whole street.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from cavsumo.network.reader import Network, driving_lanes, is_normal, street

SHORT_M = 30.0
TOUCHING_M = 10.0  # as close as netconvert joins junctions (its option junctions.join-dist)
FORK = 3  # roads that meet where another one begins
WIDEST_M = 80.0
OPPOSITE = -0.7  # cosine of the angle between the carriageways of one road, at most: 135 degrees

Pieces = dict[str, tuple[str, ...]]


def intersections(network: Network) -> Pieces:
    """For every junction the ids of the pieces of its intersection, itself among them, in order."""
    groups = {node: [node] for node in network.net.getNodes() if node.getType() != "internal"}
    inner = [e for e in network.edges if driving_lanes(e) and e.getLength() < SHORT_M]
    for edge in sorted(inner, key=lambda e: (e.getLength(), str(e.getID()))):
        a, b = edge.getFromNode(), edge.getToNode()
        if groups[a] is groups[b] or not _is_inside(edge):
            continue
        joined = groups[a] + groups[b]
        if _width(joined) <= WIDEST_M:
            groups |= dict.fromkeys(joined, joined)
    return {
        str(node.getID()): tuple(sorted(str(piece.getID()) for piece in group))
        for node, group in groups.items()
    }


def _is_inside(edge: Any) -> bool:
    """Whether a short edge lies inside an intersection."""
    a, b = edge.getFromNode(), edge.getToNode()
    touching = edge.getLength() < TOUCHING_M and min(_arms(a), _arms(b)) < FORK
    if touching or not _lights(a).isdisjoint(_lights(b)):
        return True
    names = _streets(a)
    return (len(names) > 1 and names == _streets(b)) or _between_carriageways(edge)


def _between_carriageways(edge: Any) -> bool:
    """Whether one-way roads of one name cross the ends of an edge in opposite directions."""
    ends = edge.getFromNode(), edge.getToNode()
    first, second = (list(_one_way(node, edge)) for node in ends)
    return any(
        street(a) == street(b) and _cosine(a, b) <= OPPOSITE and abs(_cosine(a, edge)) < 0.7
        for a in first
        for b in second
    )


def _one_way(node: Any, but: Any) -> Iterator[Any]:
    """The roads at a junction that lead in one direction only, apart from one road."""
    for road in (*node.getIncoming(), *node.getOutgoing()):
        if is_normal(road) and driving_lanes(road) and _ends(road) != _ends(but):
            back = road.getToNode().getOutgoing()
            if not any(e.getToNode() is road.getFromNode() and driving_lanes(e) for e in back):
                yield road


def _cosine(a: Any, b: Any) -> float:
    """The cosine of the angle between two roads, from end to end."""
    (ax, ay), (bx, by) = _direction(a), _direction(b)
    return (ax * bx + ay * by) / max(1e-9, math.hypot(ax, ay) * math.hypot(bx, by))


def _direction(road: Any) -> tuple[float, float]:
    """From the beginning of a road to its end [m]."""
    shape = road.getShape()
    return float(shape[-1][0] - shape[0][0]), float(shape[-1][1] - shape[0][1])


def _lights(node: Any) -> set[str]:
    """The ids of the traffic lights that control the roads into a junction."""
    return {
        str(edge.getTLS().getID())
        for edge in node.getIncoming()
        if is_normal(edge) and edge.getTLS() is not None
    }


def _arms(node: Any) -> int:
    """The number of junctions that roads for cars connect with one."""
    roads = [e for e in (*node.getIncoming(), *node.getOutgoing()) if is_normal(e)]
    ends = {end for road in roads if driving_lanes(road) for end in _ends(road)}
    return len(ends - {node})


def _ends(road: Any) -> set[Any]:
    """The junctions at both ends of a road."""
    return {road.getFromNode(), road.getToNode()}


def _streets(node: Any) -> set[str]:
    """The names of the roads for cars that meet at a junction."""
    roads = filter(is_normal, (*node.getIncoming(), *node.getOutgoing()))
    return {street(road) for road in roads if driving_lanes(road)} - {""}


def _width(nodes: list[Any]) -> float:
    """The largest distance between two junctions [m]."""
    places = [node.getCoord()[:2] for node in nodes]
    return max(math.dist(a, b) for a in places for b in places)
