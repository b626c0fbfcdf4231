"""The actions of events, as those of a script's storyboard."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from cavsumo.model.curve import Pose
from cavsumo.model.scenario.storyboard import StoryAction
from cavsumo.openscenario.courses import Trajectory, places_at
from cavsumo.openscenario.nodes import XmlNode
from cavsumo.openscenario.placing import Beginning, Beginnings

MOST_PLACES = 100_000  # of a track


class LeadingGap(NamedTuple):
    """A gap that an entity has before another one.

    Attributes:
        node: the action.
        after: the entity behind.
        metres: between their boxes.
        kept: whether it is kept until the entity changes its speed.
    """

    node: XmlNode
    after: str
    metres: float
    kept: bool


@dataclass
class Actions:
    """Reads actions.

    Attributes:
        beginnings: of the entities.
        ego: the name of the entity under test.
        ids: of the bodies, by the names of the entities.
        move: brings a pose to the road that is played on.
        step: length of a timestep [s], that of tracks.
        variables: names of the variables.
        deleted: entities that are removed at the beginning.
        gaps: that entities take up at the beginning.
    """

    beginnings: Beginnings
    ego: str
    ids: Mapping[str, str]
    move: Callable[[Pose], Pose]
    step: float
    variables: Mapping[str, str]
    deleted: list[str] = field(default_factory=list)
    gaps: dict[str, LeadingGap] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in self.ids:
            gap = self.beginnings.of(self.beginnings.init, name).gap
            if gap is not None:
                self._gap(gap, name)

    @property
    def paces(self) -> dict[str, str]:
        """The bodies that keep a gap, with those before which they keep it."""
        return {self.ids[k]: self.ids[gap.after] for k, gap in self.gaps.items() if gap.kept}

    def of_event(self, event: XmlNode, actors: list[str], at_once: bool) -> list[StoryAction]:
        """The actions of an event for its actors; ``at_once``: it happens at the beginning."""
        found = []
        for action in event.all("Action"):
            inner = action.one()
            if inner.tag == "GlobalAction":
                found += self._global(inner.one(), at_once)
                continue
            one = inner.one()
            if one.tag == "AppearanceAction":
                continue
            if not actors:
                raise one.refused("its group has no actors")
            found += [made for name in actors for made in self._private(one, name, at_once)]
        return found

    def _global(self, one: XmlNode, at_once: bool) -> list[StoryAction]:
        """A global action."""
        if one.tag == "EnvironmentAction":
            return []
        if one.tag == "VariableAction":
            name = one.word("variableRef")
            if name not in self.variables:
                raise one.refused(f"there is no variable {name!r}")
            return [_action(variable=name, word=one.one("SetAction").word("value"))]
        name = one.word("entityRef")
        self.beginnings.of(one, name)
        if not at_once or name == self.ego:
            raise one.refused("is understood at the beginning only, and not for the ego")
        self.deleted.append(name)
        return []

    def _private(self, one: XmlNode, name: str, at_once: bool) -> list[StoryAction]:
        """An action of one entity."""
        if name == self.ego:
            raise one.refused(
                f"{name} is the vehicle under test and decides itself; expected another actor"
            )
        body = self.ids[name]
        if one.tag == "LongitudinalAction":
            inner = one.one()
            if inner.tag == "SpeedAction":
                return [speed_action(inner, body)]
            if not at_once:
                raise inner.refused("is understood at the beginning only")
            self._gap(inner, name)
            return []
        if one.tag == "SynchronizeAction":
            return [self._arrival(one, name, body)]
        if one.tag == "RoutingAction":
            return [self._track(one.one(), name, body)]
        raise one.refused("is not understood in an event; understood: LongitudinalAction, ...")

    def _gap(self, one: XmlNode, name: str) -> None:
        """A gap before another entity that an entity takes up at the beginning, or keeps."""
        leader, kept = one.word("entityRef"), one.truth("continuous")
        given = one.word("displacement", "leadingReferencedEntity")
        if given != "leadingReferencedEntity" or leader == name or name == self.ego:
            raise one.refused("is understood for entities that lead another one")
        if kept and leader == self.ego:
            raise one.refused("continuous: expected false, nobody adapts to the vehicle under test")
        if not one.truth("freespace") or not one.has("distance"):
            raise one.refused("is understood with freespace true and a distance")
        self.gaps[name] = LeadingGap(one, leader, one.number("distance"), kept)

    def _arrival(self, one: XmlNode, name: str, body: str) -> StoryAction:
        """A body that arrives at a place as the ego arrives at one."""
        master = one.word("masterEntityRef")
        if master != self.ego:
            raise one.refused(f"masterEntityRef: expected {self.ego}, the entity under test")
        ego, own = (self.beginnings.of(one, who) for who in (self.ego, name))
        spots = [
            self.beginnings.places.spot(one.one(tag)).pose[:2]
            for tag in ("TargetPositionMaster", "TargetPosition")
        ]
        ego_at, own_at = (b.course.along(*s) for b, s in zip((ego, own), spots, strict=True))
        ending = one.one("FinalSpeed").one("AbsoluteSpeed")
        speed, steady = ending.number("value"), 0.0
        if (inner := ending.maybe()) is not None:
            by_time = inner.tag == "TargetTimeSteadyState"
            steady = inner.number("time") * speed if by_time else inner.number("distance")
        if speed <= 0.0 or own_at <= 0.0:
            raise one.refused(f"{name} would have to arrive with a speed, at a place before it")
        return _action(
            body=body,
            to_mps=speed,
            ego_at_m=ego_at + ego.entity.front,
            own_at_m=own_at,
            steady_m=min(max(steady, 0.0), own_at),
        )

    def _track(self, one: XmlNode, name: str, body: str) -> StoryAction:
        """A body that follows a polyline with times."""
        if one.tag != "FollowTrajectoryAction":
            raise one.refused("is not understood in an event")
        course, begins = self.beginnings.followed(one)
        if course.relative and not begins:
            return _action(body=body, legs=course.legs)
        if not course.times:
            raise one.refused(
                "a trajectory in an event needs times, or begins where its entity is: a "
                "ClothoidSpline without PositionStart and initialDistanceOffset"
            )
        if begins > 1e-9 and at_own_time(one):
            raise one.refused("times: expected those of a track that begins with its event")
        return _action(body=body, track=self.track_of(course, self.beginnings.of(one, name)))

    def track_of(self, course: Trajectory, who: Beginning) -> dict[str, Any]:
        """The track of the middle of a body on a course with times."""
        seconds = course.times[-1][0] - course.times[0][0]
        if seconds / self.step > MOST_PLACES:
            raise course.node.refused(f"a track of more than {MOST_PLACES} timesteps")
        every = max(self.step, 0.01)
        places = places_at(course, every, who.entity.ahead)
        return {"every_s": every, "points_m": [self.move((x, y, 0.0))[:2] for x, y in places]}


def at_own_time(action: XmlNode) -> bool:
    """Whether a trajectory begins by its own clock and not with its event."""
    reference = action.maybe("TimeReference")
    timing = reference.maybe("Timing") if reference else None
    return timing is not None and timing.word("domainAbsoluteRelative") == "relative"


def speed_action(node: XmlNode, body: str) -> StoryAction:
    """A change of speed."""
    how = node.one("SpeedActionDynamics")
    shape = how.choice("dynamicsShape", ("step", "linear"))
    to = node.one("SpeedActionTarget").one("AbsoluteTargetSpeed").number("value")
    if to < 0.0:
        raise node.refused("a speed below 0 is not understood")
    value = how.number("value")
    if shape == "step" or value == 0.0:
        return _action(body=body, to_mps=to)
    if value < 0.0:
        raise how.refused("value: expected at least 0")
    kind = how.choice("dynamicsDimension", ("time", "rate", "distance"))
    key = {"time": "in_s", "rate": "by_mps2", "distance": "over_m"}[kind]
    return _action(body=body, to_mps=to, **{key: value})


def _action(**content: Any) -> StoryAction:
    """An action of a storyboard."""
    return StoryAction.model_validate(content)
