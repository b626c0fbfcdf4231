"""The motion of one tester: as it was recorded, or in few legs.

A motion in legs follows a way, at a constant speed in each leg: "stand until 3 s, then walk
straight at 1.4 m/s" has two. The speed changes by the throttle and brake of a calm driver, or by
all that a pedestrian has, and the way is straight or the recorded track.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import groupby
from typing import NamedTuple

from cavsumo.agents.driving import BRAKING_MPS2, GAINING_MPS2, Course
from cavsumo.agents.walking import throttle_to
from cavsumo.model.bodies import WALKING, Action, Body, Kind
from cavsumo.model.carriageway import StartRecord
from cavsumo.model.kinematics import step_floats
from cavsumo.model.polyline import Path, Point
from cavsumo.model.snapshot import BodyState

Pose = tuple[float, float, float, float]  # x, y [m], v [m/s], o [rad]


class MotionLeg(NamedTuple):
    """A part of a motion at one speed."""

    step: int  # timestep from which the speed is aimed at
    speed: float  # m/s


@dataclass(frozen=True)
class BodyMotion:
    """The motion of a tester.

    Attributes:
        start: where it starts, and how fast.
        legs: in the order of their timesteps, the first at 0; empty for a motion as recorded.
        way: points of the track that the legs follow; empty for straight on.
        actions: of a motion as recorded, in each timestep.
    """

    start: StartRecord
    legs: tuple[MotionLeg, ...] = ()
    way: tuple[Point, ...] = ()
    actions: tuple[Action, ...] = ()

    @property
    def segments(self) -> int:
        """The number of its legs; as recorded, of its parts with one action each."""
        if self.legs:
            return len(self.legs)
        return sum(1 for _ in groupby(_rounded(action) for action in self.actions))

    def played(self, kind: Kind, steps: int, dt: float) -> tuple[Action, ...]:
        """Its actions in the first timesteps."""
        if not self.legs:
            return self.actions[:steps]
        return _driven(self, kind, dt)[:steps] if steps <= LONGEST else ()

    def later(self, pose: Sequence[float], steps: int) -> BodyMotion:
        """The motion from a timestep on, at which the body has a pose."""
        x, y, v, o = pose
        start = self.start._replace(x=x, y=y, v=v, o=o)
        if not self.legs:
            return replace(self, start=start, actions=self.actions[steps:])
        left = [MotionLeg(step - steps, speed) for step, speed in self.legs if step > steps]
        now = [speed for step, speed in self.legs if step <= steps][-1]
        return replace(self, start=start, legs=(MotionLeg(0, now), *left))

    def shifted(self, steps: int, dt: float) -> BodyMotion | None:
        """The motion so many timesteps earlier (negative: later), the first leg as long before.

        None for one that is not in legs, where a leg would have to begin before the episode, and
        where the body would have to start beyond the beginning of its way.
        """
        if not self.legs:
            return None
        first, *rest = self.legs
        later = [MotionLeg(step - steps, speed) for step, speed in rest]
        place = self._place(first.speed * steps * dt)
        if place is None or any(leg.step <= 0 for leg in later):
            return None
        x, y, o = place
        return replace(self, start=self.start._replace(x=x, y=y, o=o), legs=(first, *later))

    def _place(self, beyond: float) -> tuple[float, float, float] | None:
        """The place x, y, o so far beyond the start [m] on its way; None beyond its ends."""
        x, y, o = self.start.x, self.start.y, self.start.o
        if not self.way:
            return x + beyond * math.cos(o), y + beyond * math.sin(o), o
        path = Path(self.way)
        along = path.project(x, y).along + beyond
        return path.at(along) if 0.0 <= along <= path.length else None


LONGEST = 2000  # timesteps of a motion in legs


def _rounded(action: Action) -> tuple[float, float]:
    """An action without rounding errors."""
    return round(action.throttle, 3), round(action.steering, 3)


@lru_cache(maxsize=256)
def _driven(motion: BodyMotion, kind: Kind, dt: float) -> tuple[Action, ...]:
    """The actions of a motion in legs."""
    start, body = motion.start, Body("", kind)
    state = BodyState(body, start.x, start.y, start.v or 0.0, start.o)
    course = Course(Path(motion.way), kind, dt, math.inf) if motion.way else None
    speeds, actions = dict(motion.legs), []
    speed = state.v
    for step in range(LONGEST):
        speed = speeds.get(step, speed)
        throttle = _throttle(state, speed, dt)
        steering = course.steering(state) if course is not None and state.v > 0.0 else 0.0
        actions.append(Action(throttle, steering))
        limits = kind.wheelbase, kind.v_min, kind.v_max, dt
        state = BodyState(body, *step_floats(*state[1:], throttle, steering, *limits))
    return tuple(actions)


def _throttle(state: BodyState, speed: float, dt: float) -> float:
    """The throttle towards a speed."""
    throttle = throttle_to(state, speed, dt)
    if state.body.kind.name in WALKING:
        return throttle
    return max(-BRAKING_MPS2, min(GAINING_MPS2, throttle))


def gaining(kind: Kind) -> float:
    """The acceleration between legs [m/s2]."""
    return kind.throttle_max if kind.name in WALKING else GAINING_MPS2


class TrackToViolation(NamedTuple):
    """How a body came to the violation."""

    track: tuple[Pose, ...]  # its poses up to then, one a timestep
    kind: Kind
    dt: float

    @property
    def end(self) -> int:
        """The timestep of the violation."""
        return len(self.track) - 1


def in_legs(motion: BodyMotion, met: TrackToViolation) -> list[BodyMotion]:
    """Motions in one leg and in two that lead to the same place at the same time.

    Those in one leg first, straight ones before those along the track.
    """
    found = []
    for way in _ways(met):
        for speed in _speeds(met):
            found += _one_leg(motion.start, met, way, speed)
    for way in _ways(met):
        for speed in _speeds(met):
            found += _two_legs(motion.start, met, way, speed)
    return found


class _WayThere(NamedTuple):
    """A way to the violation: along the track, or straight to its end."""

    path: Path
    points: tuple[Point, ...]


def _ways(met: TrackToViolation) -> list[_WayThere]:
    """The straight way, and the track if the body moved."""
    x, y, _, o = met.track[-1]
    far = 1.0 + sum(math.dist(a[:2], b[:2]) for a, b in zip(met.track, met.track[1:], strict=False))
    straight = Path([(x - far * math.cos(o), y - far * math.sin(o)), (x, y)])
    ways = [_WayThere(straight, ())]
    if far > 2.0:
        path = Path((pose[0], pose[1]) for pose in met.track)
        end = path.at(path.length)
        beyond = end[0] + 20.0 * math.cos(o), end[1] + 20.0 * math.sin(o)
        ways.append(_WayThere(path, (*path.points, beyond)))
    return ways


def _speeds(met: TrackToViolation) -> list[float]:
    """The speed of the body at the violation, also as a whole number [m/s].

    Of a pedestrian first the nominal one.
    """
    there = round(met.track[-1][2], 1)
    if met.kind.name in WALKING:
        return [*dict.fromkeys([met.kind.v_max, there])]
    return [*dict.fromkeys([there, float(round(there))])]


def _one_leg(
    start: StartRecord, met: TrackToViolation, way: _WayThere, speed: float
) -> list[BodyMotion]:
    """Moving at one speed from the beginning on."""
    along = way.path.length - speed * met.end * met.dt
    return [_motion(start, way, along, (MotionLeg(0, speed),))] if along >= 0.0 else []


def _two_legs(
    start: StartRecord, met: TrackToViolation, way: _WayThere, speed: float
) -> list[BodyMotion]:
    """Standing, and then moving at one speed."""
    if speed <= 0.0:
        return []
    found = []
    for along in _places(met, way):
        gained = speed / gaining(met.kind)
        left = (way.path.length - along) / speed + gained / 2.0
        step = met.end - round(left / met.dt)
        if step > 0:
            found.append(_motion(start, way, along, (MotionLeg(0, 0.0), MotionLeg(step, speed))))
    return found


def _places(met: TrackToViolation, way: _WayThere) -> list[float]:
    """Where a body may stand before it sets off, as arc lengths [m].

    Where it last stood, where it last turned, and where it started.
    """
    track, last = met.track, met.track[-1]
    stood = [pose for pose in track if pose[2] <= 0.0]
    turned = [pose for pose in track if abs(pose[3] - last[3]) > 1e-3]
    poses = [*stood[-1:], *turned[-1:], track[0]]
    return list(dict.fromkeys(way.path.project(pose[0], pose[1]).along for pose in poses))


def _motion(
    start: StartRecord, way: _WayThere, along: float, legs: tuple[MotionLeg, ...]
) -> BodyMotion:
    """A motion in legs that starts at an arc length of a way."""
    x, y, o = way.path.at(along)
    return BodyMotion(start._replace(x=x, y=y, o=o, v=legs[0].speed), legs, way.points)
