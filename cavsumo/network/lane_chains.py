"""Chains of lanes, junction interiors included, as straight as the roads permit."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence
from typing import Any

from cavsumo.model.polyline import Path, Point
from cavsumo.network.reader import Network, interior, is_normal, lane_shape

BACK = "tT"  # SUMO's connection directions of turning round
# Imported networks have lanes that begin before the end of the lane that leads to them. SUMO's
# vehicles jump there; a corner sharper than this is cut, because a body cannot.
SHARPEST_RAD = math.radians(60.0)


def upstream(network: Network, lane: Any, wanted: float, apart: Collection[str]) -> list[Any]:
    """A lane and those that lead to it, until they are ``wanted`` metres or the road begins.

    Edges in ``apart`` are left out, and no edge comes twice.
    """
    chain, length, seen = [lane], float(lane.getLength()), {lane.getEdge().getID(), *apart}
    while length < wanted:
        link = _straightest(
            link
            for links in chain[0].getEdge().getIncoming().values()
            for link in links
            if link.getToLane() is chain[0] and link.getFrom().getID() not in seen
        )
        if link is None:
            break
        before = link.getFromLane()
        seen.add(before.getEdge().getID())
        chain = [before, *interior(network, link), *chain]
        length += float(before.getLength())
    return chain


def onward(network: Network, lane: Any, wanted: float) -> list[Any]:
    """A lane and those to which it leads, until they are ``wanted`` metres or the road ends."""
    chain, length, seen = [lane], float(lane.getLength()), {lane.getEdge().getID()}
    while length < wanted:
        link = _straightest(
            link for link in chain[-1].getOutgoing() if link.getTo().getID() not in seen
        )
        if link is None:
            break
        after = link.getToLane()
        seen.add(after.getEdge().getID())
        chain += [*interior(network, link), after]
        length += float(after.getLength())
    return chain


def drivable(lanes: Sequence[Any]) -> Path:
    """The centre line through a chain of lanes, without corners that cannot be driven."""
    return without_corners(point for lane in lanes for point in lane_shape(lane))


def without_corners(points: Iterable[Point]) -> Path:
    """The path through points, without those at which it would turn too sharply."""
    kept: list[Point] = []
    for point in points:
        while kept and math.dist(kept[-1], point) < 0.01:
            kept.pop()
        while len(kept) > 1 and _corner(kept[-2], kept[-1], point) > SHARPEST_RAD:
            kept.pop()
        kept.append(point)
    return Path(kept)


def _corner(a: Point, b: Point, c: Point) -> float:
    """The turn at b of a way from a over b to c [rad]."""
    turn = math.atan2(c[1] - b[1], c[0] - b[0]) - math.atan2(b[1] - a[1], b[0] - a[0])
    return abs(math.remainder(turn, math.tau))


def edge_ids(lanes: Sequence[Any]) -> tuple[str, ...]:
    """The ids of the edges of a chain of lanes, junction interiors left out."""
    return tuple(str(e.getID()) for e in (lane.getEdge() for lane in lanes) if is_normal(e))


def _straightest(links: Any) -> Any | None:
    """The connection for cars that bends least, ties by id; None when there is none."""
    usable = [
        link
        for link in links
        if link.getDirection() not in BACK
        and is_normal(link.getFrom())
        and is_normal(link.getTo())
        and link.getFromLane().allows("passenger")
        and link.getToLane().allows("passenger")
    ]
    return min(usable, key=_preference, default=None)


def _preference(link: Any) -> tuple[float, str, str]:
    """Sort key of connections."""
    return _bend(link), str(link.getFromLane().getID()), str(link.getToLane().getID())


def _bend(link: Any) -> float:
    """The change of heading from the end of one lane to the start of the next [rad]."""
    a, b = lane_shape(link.getFromLane())[-2:]
    c, d = lane_shape(link.getToLane())[:2]
    return _corner(a, b, (b[0] + d[0] - c[0], b[1] + d[1] - c[1]))
