"""Positions as poses of reference points, in the coordinates of the road network.

Where no orientation is given, a position in a lane has the direction of its traffic, one on a
road that of the reference line, one relative to an entity that entity's heading; a relative
orientation counts from the direction of the reference line, or from the entity's heading.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from cavsumo.model.curve import Pose
from cavsumo.model.geometry import wrap
from cavsumo.openscenario.courses import Trajectory, course_of
from cavsumo.openscenario.files import ScenarioFiles, declared
from cavsumo.openscenario.nodes import XmlNode
from cavsumo.openscenario.roads import OpenDriveRoad, RoadMap, RoadStage, turned


class GivenPlace(NamedTuple):
    """A pose, and where it is on a road if it was given so.

    Attributes:
        pose: of a reference point.
        road, s, t: the road, and the place on it.
        lane: the lane, with ``beside`` from its middle [m]; None for none.
    """

    pose: Pose
    road: OpenDriveRoad | None = None
    s: float = 0.0
    t: float = 0.0
    lane: int | None = None


@dataclass
class Places:
    """Positions of a scenario.

    Attributes:
        files: of the scenario.
        roads: of its road network; None for none.
        entity: the place of an entity at the beginning, by its name.
    """

    files: ScenarioFiles
    roads: RoadMap | None
    entity: Callable[[XmlNode, str], GivenPlace]

    def spot(self, position: XmlNode) -> GivenPlace:
        """The place of a position: the element that holds it, or the position itself."""
        kinds = {
            "WorldPosition": self._world,
            "LanePosition": self._lane,
            "RoadPosition": self._road,
            "RelativeLanePosition": self._beside_lane,
            "RelativeRoadPosition": self._along_road,
            "RelativeObjectPosition": self._beside,
            "RelativeWorldPosition": self._offset,
            "RoutePosition": self._on_route,
            "TrajectoryPosition": self._on_trajectory,
        }
        inner = position if position.tag in kinds else position.one()
        return kinds[inner.tag](inner)

    def _map(self, node: XmlNode) -> RoadMap:
        if self.roads is None:
            raise node.refused("needs a road network, and RoadNetwork names none")
        return self.roads

    def _world(self, node: XmlNode) -> GivenPlace:
        return GivenPlace((node.number("x"), node.number("y"), wrap(node.number("h", 0.0))))

    def _lane(self, node: XmlNode) -> GivenPlace:
        road = self._map(node).road(node, node.word("roadId"))
        s, lane = node.number("s"), int(node.number("laneId"))
        t = road.lane(node, lane, s)[0] + node.number("offset", 0.0)
        turn = 0.0 if road.drives_forward(lane) else math.pi
        return _oriented(node, GivenPlace(road.at(s, t), road, s, t, lane), turn)

    def _road(self, node: XmlNode) -> GivenPlace:
        road = self._map(node).road(node, node.word("roadId"))
        s, t = node.number("s"), node.number("t")
        return _oriented(node, GivenPlace(road.at(s, t), road, s, t))

    def _beside_lane(self, node: XmlNode) -> GivenPlace:
        other = self._placed(node)
        if other.lane is None or other.road is None:
            raise node.refused(f"{node.word('entityRef')} is not placed in a lane")
        lane = other.lane + int(node.number("dLane"))
        if lane == 0 or (lane > 0) != (other.lane > 0):  # there is no lane 0
            lane += 1 if lane >= 0 and other.lane < 0 else -1 if other.lane > 0 >= lane else 0
        s = other.s + node.number("ds")
        t = other.road.lane(node, lane, s)[0] + node.number("offset", 0.0)
        turn = 0.0 if other.road.drives_forward(lane) else math.pi
        return _oriented(node, GivenPlace(other.road.at(s, t), other.road, s, t, lane), turn)

    def _along_road(self, node: XmlNode) -> GivenPlace:
        other = self._placed(node)
        if other.road is None:
            raise node.refused(f"{node.word('entityRef')} is not placed on a road")
        s, t = other.s + node.number("ds"), other.t + node.number("dt")
        return _oriented(node, GivenPlace(other.road.at(s, t), other.road, s, t))

    def _beside(self, node: XmlNode) -> GivenPlace:
        x, y, o = self._placed(node).pose
        dx, dy = node.number("dx"), node.number("dy")
        c, s = math.cos(o), math.sin(o)
        return _oriented(node, GivenPlace((x + dx * c - dy * s, y + dx * s + dy * c, o)))

    def _offset(self, node: XmlNode) -> GivenPlace:
        x, y, o = self._placed(node).pose
        return _oriented(node, GivenPlace((x + node.number("dx"), y + node.number("dy"), o)))

    def _placed(self, node: XmlNode) -> GivenPlace:
        return self.entity(node, node.word("entityRef"))

    def _on_route(self, node: XmlNode) -> GivenPlace:
        route = self.resolved(node.one("RouteRef"), "Route")
        where = node.one("InRoutePosition").one("FromLaneCoordinates", "FromRoadCoordinates")
        left = where.number("pathS") + self._first(route).s
        stages = self.stages(route)
        for k, stage in enumerate(stages):
            if left <= stage.road.length or k == len(stages) - 1:
                break
            left -= stage.road.length
        road, forward = stage
        s, turn = (left, 0.0) if forward else (road.length - left, math.pi)
        if where.tag == "FromRoadCoordinates":
            t = where.number("t")
            return _oriented(node, GivenPlace(road.at(s, t), road, s, t), turn)
        # Lanes and orientations are those of the road there, as in a LanePosition.
        lane = int(where.number("laneId"))
        t = road.lane(where, lane, s)[0] + where.number("laneOffset", 0.0)
        turn = 0.0 if road.drives_forward(lane) else math.pi
        return _oriented(node, GivenPlace(road.at(s, t), road, s, t, lane), turn)

    def _on_trajectory(self, node: XmlNode) -> GivenPlace:
        course = self.course(self.resolved(node.one("TrajectoryRef"), "Trajectory"))
        if course.relative:
            raise node.refused("the trajectory has no PositionStart, so it is nowhere")
        x, y, o = course.curve.at(node.number("s"))
        t = node.number("t", 0.0)
        return _oriented(node, GivenPlace((x - t * math.sin(o), y + t * math.cos(o), o)))

    # Trajectories and routes

    def resolved(self, holder: XmlNode, tag: str) -> XmlNode:
        """The element of a name in another one, itself or from a catalog, with its parameters."""
        itself = holder.tag in (tag, "CatalogReference")
        inner = holder if itself else holder.one(tag, "CatalogReference")
        if inner.tag == "CatalogReference":
            inner = self.files.entry(inner)
            if inner.tag != tag:
                raise holder.refused(f"expected the name of a {tag}, this is a {inner.tag}")
            return inner
        return inner.within(declared(inner, {}))

    def course(self, trajectory: XmlNode) -> Trajectory:
        """The way of a trajectory."""
        return course_of(trajectory, lambda node: self.spot(node).pose)

    def stages(self, route: XmlNode) -> list[RoadStage]:
        """The roads of a route."""
        spots = [self.spot(one.one("Position")) for one in route.all("Waypoint")]
        first = self._first(route)
        assert first.road is not None
        along = first.lane is None or first.road.drives_forward(first.lane)
        stages = [RoadStage(first.road, along)]
        for spot in spots[1:]:
            if spot.road is None:
                raise route.refused("a waypoint is not on a road")
            stages += self._map(route).route(route, stages[-1], spot.road)[1:]
        return stages

    def _first(self, route: XmlNode) -> GivenPlace:
        """The first waypoint."""
        spot = self.spot(route.one("Waypoint").one("Position"))
        if spot.road is None:
            raise route.refused("a waypoint is not on a road")
        return spot


def _oriented(node: XmlNode, spot: GivenPlace, turn: float = 0.0) -> GivenPlace:
    """A place with the orientation that a position gives; ``turn``: if it gives none."""
    given = node.maybe("Orientation")
    if given is None or not given.has("h"):
        return spot._replace(pose=turned(spot.pose, turn))
    h = given.number("h")
    if given.choice("type", ("absolute", "relative"), "absolute") == "absolute":
        return spot._replace(pose=(*spot.pose[:2], wrap(h)))
    return spot._replace(pose=turned(spot.pose, h))
