"""The ways through a junction for a car, and their order by what they offer to a test."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from cavsumo.network.reader import (
    Network,
    driving_lanes,
    is_normal,
    is_pavement,
    lane_path,
)

APPROACH_M = 80.0  # how far before the junction the ego starts, where the roads allow it
EXIT_M = 50.0  # how far after the junction it is followed
HEADING_M = 5.0  # stretch before and after a junction that determines the turn of a movement
STRAIGHT, BACK = "s", "tT"  # SUMO's connection directions
TURNS = ("straight", "left", "right", "u-turn")
YIELDING = "m=sw"  # SUMO's link states without right of way


def ranked_movements(network: Network, junction_id: str | None = None) -> list[Movement]:
    """The ways through a junction, or through all: those over crossings, straight on and well
    approached first, ties by id; U-turns are left out."""
    nodes = [network.junction(junction_id)] if junction_id else network.net.getNodes()
    crossed = network.crossed_edges()
    found = (m for node in nodes for m in movements(node) if not m.turns_back)
    return sorted(found, key=lambda m: worth(m, crossed))


@dataclass(frozen=True)
class Movement:
    """One way through a junction.

    Attributes:
        into, out: the edges it leads from and to.
        node: the junction.
        direction: SUMO's letter for it.
        lanes: the first pair of lanes that it connects.
    """

    into: Any
    out: Any
    node: Any
    direction: str
    lanes: tuple[Any, Any]

    @property
    def turns_back(self) -> bool:
        """Whether it is a U-turn."""
        return self.direction in BACK

    @property
    def turn(self) -> str:
        """The turn by its geometry: straight is within 45 degrees of straight on.

        U-turns are SUMO's, because a road may return beside itself by any angle.
        """
        if self.turns_back:
            return "u-turn"
        before, after = (lane_path([lane]) for lane in self.lanes)
        a = before.at(before.length)[:2], before.at(max(0.0, before.length - HEADING_M))[:2]
        b = after.at(min(after.length, HEADING_M))[:2], after.at(0.0)[:2]
        came, goes = (math.atan2(p[1] - q[1], p[0] - q[0]) for p, q in (a, b))
        angle = math.remainder(goes - came, 2 * math.pi)
        if abs(angle) <= math.pi / 4:
            return "straight"
        return "left" if angle > 0 else "right"


def movements(node: Any) -> list[Movement]:
    """Each way a car may drive through a junction, once per pair of edges, U-turns included."""
    found: dict[tuple[str, str], Movement] = {}
    for into in filter(is_normal, node.getIncoming()):
        for lane in driving_lanes(into):
            for link in lane.getOutgoing():
                out, target = link.getTo(), link.getToLane()
                if target.allows("passenger") and is_normal(out):
                    pair = (str(into.getID()), str(out.getID()))
                    movement = Movement(into, out, node, str(link.getDirection()), (lane, target))
                    found.setdefault(pair, movement)
    return list(found.values())


def worth(movement: Movement, crossed: set[str]) -> tuple[Any, ...]:
    """Sort key that puts the movement most suited to tests first."""
    into, out = movement.into, movement.out
    before = upstream(into)
    approach = math.fsum(e.getLength() for e in before)
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


def upstream(edge: Any) -> list[Any]:
    """The edge and the edges leading straight to it, until the approach is long enough."""
    return _prolonged(edge, APPROACH_M, lambda e: _straight(e.getIncoming()))[::-1]


def downstream(edge: Any) -> list[Any]:
    """The edge and the edges leading straight on from it, until the exit is long enough."""
    return _prolonged(edge, EXIT_M, lambda e: _straight(e.getOutgoing()))


def _prolonged(edge: Any, wanted: float, onward: Callable[[Any], list[Any]]) -> list[Any]:
    """Edges one after another until they are long enough together or the road ends."""
    chain = [edge]
    while math.fsum(e.getLength() for e in chain) < wanted:
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
