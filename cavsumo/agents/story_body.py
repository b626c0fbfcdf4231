"""A body of a storyboard in one episode: where it is at any time that is decided.

It moves along its way by segments of motion, or follows a track. A way may be left for another one
that begins where the body is; its reference point follows that, its middle is ahead of that point.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from cavsumo.model.curve import PlaneCurve, Pose
from cavsumo.model.motion import Motion
from cavsumo.model.scenario.script import Programme
from cavsumo.model.scenario.storyboard import StoryAction
from cavsumo.model.scenario.track import Place, ScriptedTrack


class BodyWay(NamedTuple):
    """A way that a body follows from a moment on.

    Attributes:
        begins: that moment [s].
        gone: how far the body had gone then [m].
        curve: of a point of the body.
        ahead: how far its middle is before that point [m].
    """

    begins: float
    gone: float
    curve: PlaneCurve
    ahead: float

    def middle(self, gone: float) -> Pose:
        """The pose of the middle when the body has gone so far [m]."""
        x, y, o = self.curve.at(gone - self.gone)
        return x + self.ahead * math.cos(o), y + self.ahead * math.sin(o), o


class MotionSegment(NamedTuple):
    """A part of a body's motion: from a moment [s] on, at a distance on its way [m]."""

    begins: float
    ahead: float
    motion: Motion


@dataclass
class StoryBody:
    """A body of a storyboard in one episode.

    Attributes:
        id: of the body.
        programme: its box, its way and its first speed.
        paced: the body whose motion it shares until it gets one of its own; None for none.
        segments: of its motion along its way.
        ways: that it follows, one after another.
        track: that it follows in place of them, from the moment ``since`` on.
        arrival: by which it will commit; with the event of which it is.
    """

    id: str
    programme: Programme
    paced: StoryBody | None = None
    segments: list[MotionSegment] = field(default_factory=list)
    ways: list[BodyWay] = field(default_factory=list)
    track: ScriptedTrack | None = None
    since: float = math.inf
    arrival: tuple[StoryAction, int] | None = None

    def __post_init__(self) -> None:
        self.ways = [BodyWay(-math.inf, 0.0, self.programme.way.curve, 0.0)]
        self.segments = [MotionSegment(-math.inf, 0.0, Motion(self.programme.speed_mps))]

    def along(self, time: float) -> tuple[float, float]:
        """Distance on its ways [m] and speed [m/s] at a time."""
        if self.paced is not None and (len(self.segments) == 1 or time < self.segments[1].begins):
            return self.paced.along(time)
        one = next(s for s in reversed(self.segments) if s.begins <= time or s.begins < 0.0)
        begins = max(0.0, one.begins)
        s, v = one.motion.at(time - begins)
        return one.ahead + s, v

    def place(self, time: float) -> Place:
        """Where its middle is at a time."""
        if self.track is not None and time >= self.since:
            return self.track.at(time - self.since)
        return self._on_way(time)[:2]

    def pose(self, time: float) -> tuple[Pose, float]:
        """Its pose and speed at a time, for a rehearsal without kinematics."""
        v = self.along(time)[1]
        if self.track is None or time < self.since:
            return self._on_way(time), v
        (x, y), (x1, y1) = self.place(time), self.place(time + self.track.every_s)
        moved = math.dist((x, y), (x1, y1))
        heading = math.atan2(y1 - y, x1 - x) if moved else self.track.heading
        return (x, y, heading), moved / self.track.every_s

    def change(self, moment: float, motion: Motion) -> None:
        """Begin another motion."""
        self.segments.append(MotionSegment(moment, self.along(moment)[0], motion))

    def turn(self, moment: float, curve: PlaneCurve, ahead: float) -> None:
        """Leave its way for another one of its reference point; ``ahead``: of that, its middle."""
        self.ways.append(BodyWay(moment, self.along(moment)[0], curve, ahead))

    def when(self, gone: float) -> float:
        """When it has gone so far [s], if its motion stays what it is."""
        one = self.segments[-1]
        begins = max(0.0, one.begins)
        if self.paced is not None and len(self.segments) == 1:
            return self.paced.when(gone)
        return begins + one.motion.when(gone - one.ahead)

    @property
    def prescribed(self) -> float:
        """From when on its places are prescribed, and not only how far it has gone [s]."""
        return min(self.since, self.ways[1].begins if len(self.ways) > 1 else math.inf)

    def _on_way(self, time: float) -> Pose:
        """The pose of its middle on the way that it follows at a time."""
        way = next(one for one in reversed(self.ways) if one.begins <= time)
        return way.middle(self.along(time)[0])
