"""The ways on which vehicles can meet the ego: across its path, into it, ahead of it, beside it.

Conflicts of two ways are found from their shapes and not from the network's tables of foes, which
contain neither the widths of bodies nor the separate lanes of a road.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import shapely
from shapely.geometry import LineString, Polygon

from cavsumo.errors import NetworkError
from cavsumo.model.bodies import Kind
from cavsumo.model.carriageway import Approach
from cavsumo.model.geometry import Box, corners
from cavsumo.model.polyline import Path
from cavsumo.network.ego_routes import EgoRoute
from cavsumo.network.lane_chains import drivable, edge_ids, onward, upstream, without_corners
from cavsumo.network.reader import (
    Network,
    driving_lanes,
    interior,
    is_normal,
    lane_path,
    lane_shape,
)

UPSTREAM_M = 100.0  # how far before the stop line an approach begins, where the roads allow it
ONWARD_M = 120.0  # how far a vehicle drives on after the junction
BEYOND_M = 60.0  # how far a vehicle on the ego's lane drives on after the end of the ego's way
SEARCH_M = 25.0  # a way that first meets the ego's this far after the junction is no conflict
STEP_M = 0.5  # resolution at which a way is compared with the ego's
GRAZING_M = 3.0  # a shorter contact of two ways does not count
CLEAR_M = 0.5  # distance kept to the stop line and to the ego's strip while waiting
BESIDE_M = (2.0, 5.0)  # distance between the axes of lanes that lie side by side
PARALLEL_RAD = 0.3
SHARED_M = 30.0  # shorter parallel lanes are too short for cutting in
OWN_M = 1.0  # a lane whose middle lies this close to the ego's path is the ego's own
TOO_SHARP = 1.1  # margin between the tightest bend of a way and the turn of which a body is capable


def approaches(
    network: Network, route: EgoRoute, ego: Kind, kind: Kind, wanted: Sequence[str] = ()
) -> tuple[Approach, ...]:
    """All ways on which a body of that kind can meet an ego on its route, ties by id.

    ``wanted`` are the types to keep, all if it is empty. The junction under test comes first: other
    junctions on the ego's route are searched only if no way crosses or merges there. Raises
    NetworkError when there is none.
    """
    edges = [network.edge(i) for i in route.edges]
    nodes = [e.getToNode() for e in edges[:-1]]
    tested = [n for n in nodes if n.getID() == route.junction]
    search = _Search(network, route, ego, kind)
    met = [a for node in tested for a in search.through(node)] or [
        a for node in nodes for a in search.through(node)
    ]
    found = [*met, *search.ahead(edges), *search.beside(edges)]
    kept = tuple(a for a in found if not wanted or a.type in wanted)
    if not kept:
        there = ", ".join(sorted({a.type for a in found}))
        sort = " or ".join(wanted) + " " if wanted else ""
        raise NetworkError(
            f"{network.file}: no {sort}way for a {kind.name} meets the ego's "
            f"route{f' (there are: {there})' if there else ''}; choose another with --junction or "
            "--ego-route"
        )
    return kept


class _Search:
    """The search for approaches of one kind of body to one route."""

    def __init__(self, network: Network, route: EgoRoute, ego: Kind, kind: Kind) -> None:
        self.network, self.route, self.kind = network, route, kind
        self.strip = LineString(route.path.points).buffer(ego.width / 2, cap_style="flat")
        first = network.edge(route.edges[0])
        self.ego_speed = max(float(lane.getSpeed()) for lane in driving_lanes(first))
        shapely.prepare(self.strip)

    def through(self, node: Any) -> Iterator[Approach]:
        """The ways through a junction that cross the ego's or merge with it."""
        ego_links = _links_on(self.route.edges, node)
        for into in sorted(node.getIncoming(), key=lambda e: str(e.getID())):
            if not is_normal(into) or into.getID() in self.route.edges:
                continue
            for lane in driving_lanes(into):
                for link in lane.getOutgoing():
                    if is_normal(link.getTo()) and link.getToLane().allows("passenger"):
                        found = self._meeting(lane, link, ego_links)
                        if found is not None:
                            yield found

    def ahead(self, edges: Sequence[Any]) -> Iterator[Approach]:
        """The ego's own lane, ahead of it."""
        path = self._own(edges)
        if path is not None and self._can_turn(path):
            ids = tuple(str(e.getID()) for e in edges)
            v = self.ego_speed
            yield Approach("following", path, ids, math.inf, 0.0, math.inf, 0.0, False, v, v, path)

    def beside(self, edges: Sequence[Any]) -> Iterator[Approach]:
        """The lanes beside the ego's own in its direction, the longest stretch of each."""
        into = self._own(edges)
        seen: set[tuple[Any, ...]] = set()
        for edge in edges:
            lanes = driving_lanes(edge)
            own = [lane for lane in lanes if self._is_own(lane)]
            for lane in lanes:
                near = any(abs(lane.getIndex() - o.getIndex()) == 1 for o in own)
                if not near or into is None:
                    continue
                found = self._side_by_side(lane, into)
                if found is not None and found.path.points not in seen:
                    seen.add(found.path.points)
                    yield found

    def _meeting(self, lane: Any, link: Any, ego_links: Sequence[Any]) -> Approach | None:
        """The way over a connection, None unless it meets the ego's."""
        before = upstream(self.network, lane, UPSTREAM_M, self.route.edges)
        inside = interior(self.network, link)
        after = onward(self.network, link.getToLane(), ONWARD_M)
        path = drivable([*before, *inside, *after])
        stop = path.project(*lane_shape(lane)[-1]).along
        end = path.project(*lane_shape(link.getToLane())[0]).along + SEARCH_M
        span = self._span(path, max(0.0, stop - self.kind.length), min(end, path.length))
        if (
            span is None
            or span[1] - span[0] < GRAZING_M
            or not self._can_turn(path.cut(0.0, end) if end < path.length else path)
        ):
            return None
        enter, leave = span
        wait = min(stop - self.kind.length / 2, enter) - CLEAR_M
        if wait < self.kind.length / 2:
            return None
        merging = leave > end - STEP_M
        return Approach(
            "merging" if merging else "crossing",
            path,
            edge_ids([*before, *after]),
            wait,
            enter,
            math.inf if merging else leave,
            self._touched(path, enter),
            _gives_way(self.network, link, ego_links),
            float(lane.getSpeed()),
            self.ego_speed,
        )

    def _span(self, path: Path, begin: float, end: float) -> tuple[float, float] | None:
        """The first interval of arc lengths in which a body on a path touches the ego's strip."""
        count = max(1, math.ceil((end - begin) / STEP_M))
        marks = [begin + (end - begin) * i / count for i in range(count + 1)]
        touching = [self.strip.intersects(Polygon(corners(self._box(path, s)))) for s in marks]
        if True not in touching:
            return None
        first = touching.index(True)
        last = touching.index(False, first) if False in touching[first:] else count
        return marks[max(0, first - 1)], marks[last]

    def _touched(self, path: Path, enter: float) -> float:
        """Arc length at which the ego would touch a body that has just entered its strip."""
        body = Polygon(corners(self._box(path, enter + STEP_M)))
        part = self.strip.intersection(body)
        points = shapely.get_coordinates(part if not part.is_empty else body)
        return min(self.route.path.project(float(x), float(y)).along for x, y in points)

    def _box(self, path: Path, along: float) -> Box:
        return Box(*path.at(along), self.kind.length, self.kind.width)

    def _can_turn(self, path: Path) -> bool:
        """Whether a body of the kind can follow a path at full steering."""
        radius = self.kind.wheelbase / (2.0 * self.kind.turning)
        marks = range(0, math.ceil(path.length))
        return max(path.curvature(float(s)) for s in marks) * radius * TOO_SHARP < 1.0

    def _own(self, edges: Sequence[Any]) -> Path | None:
        """The ego's path, continued along the lane in which it ends."""
        own = [lane for lane in driving_lanes(edges[-1]) if self._is_own(lane)]
        if not own:
            return None
        on = lane_path(onward(self.network, own[0], own[0].getLength() + BEYOND_M))
        here = on.project(*self.route.path.points[-1]).along
        if here > on.length - 1.0:
            return without_corners(self.route.path.points)
        return without_corners([*self.route.path.points, *on.cut(here, on.length).points[1:]])

    def _is_own(self, lane: Any) -> bool:
        """Whether the ego drives on a lane."""
        path = lane_path([lane])
        x, y, _ = path.at(path.length / 2)
        here = self.route.path.project(x, y)
        if 0.0 < here.along < self.route.path.length:
            return abs(here.lateral) < OWN_M
        ends = [self.route.path.points[0], self.route.path.points[-1]]
        return any(abs(path.project(*p).lateral) < OWN_M for p in ends)

    def _side_by_side(self, lane: Any, into: Path) -> Approach | None:
        """The way along a lane beside the ego's own."""
        lanes = [
            *upstream(self.network, lane, UPSTREAM_M, ()),
            *onward(self.network, lane, ONWARD_M)[1:],
        ]
        path, ego = drivable(lanes), self.route.path
        marks = [i * STEP_M for i in range(int(path.length / STEP_M) + 1)]
        span = _longest([_alongside(path.at(s), ego) for s in marks])
        enter, leave = (marks[i] for i in span)
        if leave - enter < SHARED_M or not self._can_turn(path):
            return None
        touched = ego.project(*path.at(enter)[:2]).along
        v, limit = self.ego_speed, float(lane.getSpeed())
        return Approach(
            "adjacent",
            path,
            edge_ids(lanes),
            math.inf,
            enter,
            leave,
            touched,
            False,
            limit,
            v,
            into,
        )


def _alongside(pose: tuple[float, float, float], ego: Path) -> bool:
    """Whether a lane at a pose lies beside a path, in its direction."""
    x, y, o = pose
    here = ego.project(x, y)
    if not (0.0 < here.along < ego.length and BESIDE_M[0] <= abs(here.lateral) <= BESIDE_M[1]):
        return False
    return abs(math.remainder(o - ego.at(here.along)[2], math.tau)) < PARALLEL_RAD


def _longest(flags: Sequence[bool]) -> tuple[int, int]:
    """First and last index of the longest run of True; (0, 0) when there is none."""
    best, begin = (0, 0), None
    for i, flag in enumerate([*flags, False]):
        if flag and begin is None:
            begin = i
        elif not flag and begin is not None:
            if i - 1 - begin > best[1] - best[0]:
                best = begin, i - 1
            begin = None
    return best


def _links_on(edge_ids: Sequence[str], node: Any) -> list[Any]:
    """The connections through a junction from one edge of a route to the next."""
    pairs = set(pairwise(edge_ids))
    return [
        link
        for into in node.getIncoming()
        for lane in driving_lanes(into)
        for link in lane.getOutgoing()
        if (into.getID(), link.getTo().getID()) in pairs
    ]


def _gives_way(network: Network, link: Any, ego_links: Sequence[Any]) -> bool:
    """Whether a connection has to give way to the ego's, by its lights or its priority.

    By lights: it has no full green in any phase in which the ego's has green.
    """
    for ego in ego_links:
        if link.getTLSID() and link.getTLSID() == ego.getTLSID():
            mine, its = link.getTLLinkIndex(), ego.getTLLinkIndex()
            programs = network.net.getTLS(link.getTLSID()).getPrograms().values()
            states = [phase.state for program in programs for phase in program.getPhases()]
            return not any(state[its] in "Gg" and state[mine] == "G" for state in states)
        node = link.getFrom().getToNode()
        if node.forbids(ego, link):
            return not node.forbids(link, ego)
    return False
