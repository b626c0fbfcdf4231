"""Where the entities are at the beginning, how fast they are, and the ways that they follow."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from cavsumo.errors import UnknownName
from cavsumo.model.curve import Bend, PlaneCurve
from cavsumo.openscenario.courses import Trajectory
from cavsumo.openscenario.entities import Entity
from cavsumo.openscenario.files import ScenarioFiles
from cavsumo.openscenario.nodes import XmlNode
from cavsumo.openscenario.places import GivenPlace, Places
from cavsumo.openscenario.roads import RoadMap, RoadStage, turned


@dataclass
class Beginning:
    """An entity at the beginning.

    Attributes:
        entity: who it is.
        spot: where its reference point is.
        speed: how fast it is [m/s].
        course: the way of its reference point from there on.
        track_from: when its course begins, if that has times; None for a course without.
        gap: the distance to another entity that it takes up; None for none.
        backwards: whether it drives backwards; then ``entity`` has its rear as its front.
    """

    entity: Entity
    spot: GivenPlace
    speed: float
    course: Trajectory
    track_from: float | None = None
    gap: XmlNode | None = None
    backwards: bool = False


@dataclass
class _Init:
    """The actions of an entity at the beginning, as they are read."""

    spot: GivenPlace | None = None
    route: XmlNode | None = None
    course: Trajectory | None = None
    start: float = 0.0
    speed: float = 0.0
    gap: XmlNode | None = None


@dataclass
class Beginnings:
    """The beginnings of all entities, each found when it is needed.

    Attributes:
        entities: by their names.
        init: the element Init.
        files, roads: see ``Places``.
        variables: of the scenario, with their values at the beginning.
    """

    entities: Mapping[str, Entity]
    init: XmlNode
    files: ScenarioFiles
    roads: RoadMap | None
    variables: Mapping[str, str] = field(default_factory=dict)
    places: Places = field(init=False)
    _found: dict[str, Beginning] = field(default_factory=dict)
    _open: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.places = Places(self.files, self.roads, lambda node, name: self.of(node, name).spot)
        for one in self.init.one("Actions").all("Private"):
            self._known(one, one.word("entityRef"))

    def of(self, node: XmlNode, name: str) -> Beginning:
        """The beginning of an entity; ``node`` names it."""
        entity = self._known(node, name)
        if name in self._open:
            raise node.refused(f"the place of {name} depends on itself")
        if name not in self._found:
            self._open.append(name)
            self._found[name] = self._begun(entity)
            self._open.pop()
        return self._found[name]

    def _known(self, node: XmlNode, name: str) -> Entity:
        """The entity of that name."""
        if name not in self.entities:
            place = f"{node.xml.file!r}: line {node.xml.line}: <{node.tag}>"
            raise UnknownName("entity", name, self.entities, place)
        return self.entities[name]

    def _begun(self, entity: Entity) -> Beginning:
        """The beginning of an entity."""
        found = _Init()
        for one in self._actions(entity.name):
            inner = one.one() if one.tag in ("LongitudinalAction", "RoutingAction") else one
            if one.tag == "TeleportAction":
                found.spot = self.places.spot(one.one("Position"))
            elif inner.tag == "LongitudinalDistanceAction":
                found.gap = inner
            elif one.tag == "LongitudinalAction":
                found.speed = first_speed(inner)
            elif inner.tag == "AssignRouteAction":
                found.route = self.places.resolved(inner, "Route")
            elif inner.tag == "FollowTrajectoryAction":
                found.course, found.start = self.followed(inner)
            elif one.tag != "AppearanceAction":
                raise one.refused("is not understood at the beginning")
        begun = self._placed(entity, found)
        begun.gap = found.gap
        return _backwards(begun) if begun.speed < 0.0 else begun

    def _placed(self, entity: Entity, found: _Init) -> Beginning:
        """The beginning of an entity with the actions that it has there."""
        spot, course = found.spot, found.course
        if course is not None and not course.relative:
            return self._on_course(entity, course, found.start, found.speed)
        if spot is None:
            raise entity.node.refused(f"{entity.name} has no place: no TeleportAction in Init")
        if course is not None:
            here = replace(course, begin=spot.pose, relative=False)
            return self._on_course(entity, here, found.start, found.speed)
        return Beginning(entity, spot, found.speed, self._way_on(entity, spot, found.route))

    def _actions(self, name: str) -> list[XmlNode]:
        """The private actions of an entity at the beginning."""
        return [
            action.one()
            for private in self.init.one("Actions").all("Private")
            if private.word("entityRef") == name
            for action in private.all("PrivateAction")
        ]

    def followed(self, action: XmlNode) -> tuple[Trajectory, float]:
        """The course of a FollowTrajectoryAction, and the place or the time at which it begins."""
        holder = action.maybe("TrajectoryRef") or action
        course = self.places.course(self.places.resolved(holder, "Trajectory"))
        reference = action.maybe("TimeReference")
        timing = reference.maybe("Timing") if reference else None
        offset = action.number("initialDistanceOffset", 0.0)
        if not course.times:
            if timing is not None:
                raise timing.refused("the trajectory has no times")
            return course, offset
        if timing is None:
            raise action.refused("a trajectory with times needs a TimeReference with Timing")
        if offset:
            raise action.refused("initialDistanceOffset is not understood with times")
        if timing.number("scale", 1.0) != 1.0:
            raise timing.refused("scale: expected 1")
        kind = timing.choice("domainAbsoluteRelative", ("absolute", "relative"))
        begins = course.times[0][0] + timing.number("offset", 0.0)
        if kind == "relative" and begins < 0.0:
            raise timing.refused("offset: the trajectory would begin before its action")
        return course, begins

    def _on_course(
        self, entity: Entity, course: Trajectory, start: float, speed: float
    ) -> Beginning:
        """The beginning on a trajectory."""
        if course.times:
            return Beginning(entity, GivenPlace(course.times[0][1]), speed, course, start)
        cut = _cut(course, start)
        return Beginning(entity, GivenPlace(cut.begin), speed, cut)

    def _way_on(self, entity: Entity, spot: GivenPlace, route: XmlNode | None) -> Trajectory:
        """The way from a place on: along a route, else along its road, else straight on."""
        if spot.road is None or (spot.lane is None and route is None):
            return Trajectory(entity.node, spot.pose)
        ahead = math.cos(spot.pose[2] - spot.road.at(spot.s)[2])
        if abs(ahead) < 0.999:
            return Trajectory(entity.node, spot.pose)  # it goes across the road
        stages = [RoadStage(spot.road, ahead > 0.0)]
        if route is not None:
            stages = _from(stages[0], self.places.stages(route))
        return Trajectory(entity.node, spot.pose, tuple(_legs(entity.node, stages, spot)))


def _backwards(one: Beginning) -> Beginning:
    """The beginning of an entity that drives backwards, as one that drives forwards.

    Its rear is its front; it looks against the way that it drives along.
    """
    if not one.course.legs or one.course.times:
        raise one.entity.node.refused(
            f"{one.entity.name} drives backwards, which is understood along a trajectory only"
        )
    entity = replace(one.entity, ahead=-one.entity.ahead)
    spot = one.spot._replace(pose=turned(one.spot.pose, math.pi))
    return replace(one, entity=entity, spot=spot, speed=-one.speed, backwards=True)


def first_speed(action: XmlNode) -> float:
    """The speed that an action gives at the beginning [m/s]."""
    if action.tag != "SpeedAction":
        raise action.refused("is not understood at the beginning; understood: SpeedAction")
    shape = action.one("SpeedActionDynamics")
    if shape.word("dynamicsShape") != "step":
        raise shape.refused("dynamicsShape: expected step at the beginning")
    return action.one("SpeedActionTarget").one("AbsoluteTargetSpeed").number("value")


def _from(first: RoadStage, stages: list[RoadStage]) -> list[RoadStage]:
    """The rest of a route from one of its roads on."""
    names = [stage.road.id for stage in stages]
    return stages[names.index(first.road.id) :] if first.road.id in names else [first]


def _legs(node: XmlNode, stages: list[RoadStage], spot: GivenPlace) -> list[Bend]:
    """The legs of a way along roads, from a place on, at the same distance from their lines."""
    left = spot.t if stages[0].forward else -spot.t
    found: list[Bend] = []
    for k, (road, forward) in enumerate(stages):
        begins = spot.s if k == 0 else 0.0 if forward else road.length
        pieces = road.pieces if forward else road.pieces[::-1]
        for piece in pieces:
            low, high = piece.begins, piece.begins + piece.leg.length
            first, last = (max(low, begins), high) if forward else (min(high, begins), low)
            length = last - first if forward else first - last
            if length > 1e-9:
                found.append(_beside(node, piece.leg, length, forward, left))
    return found


def _beside(node: XmlNode, leg: Bend, length: float, forward: bool, left: float) -> Bend:
    """A part of a leg of a reference line, gone in a direction, beside it by a distance [m]."""
    if leg.first != leg.last:
        raise node.refused("its way leads along a spiral, which is understood in trajectories only")
    k = leg.first if forward else -leg.first
    scale = 1.0 - k * left
    if scale <= 0.0:
        raise node.refused("its way leads along an arc narrower than its distance from it")
    return Bend(length * scale, k / scale, k / scale)


def _cut(course: Trajectory, start: float) -> Trajectory:
    """A course from a distance on."""
    if start == 0.0:
        return course
    legs, left = list(course.legs), start
    while legs and left >= legs[0].length:
        left -= legs.pop(0).length
    if legs:
        leg = legs[0]
        k = leg.first + (leg.last - leg.first) * left / leg.length
        legs[0] = Bend(leg.length - left, k, leg.last)
    begin = PlaneCurve(course.begin, course.legs).at(start)
    return Trajectory(course.node, begin, tuple(legs))
