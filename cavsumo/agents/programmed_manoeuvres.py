"""The manoeuvres of vehicles with the numbers of a programme, in two legs.

The approach on which a vehicle starts decides what the numbers mean: it runs the line, creeps over
it, hesitates or stands in the ego's way; it brakes ahead of the ego; or it cuts in from the lane
beside and slows down. Its speed, throttle and turn stay within those of ordinary drivers, which are
narrower than those of its kind.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

from cavsumo.agents.cues import Cue
from cavsumo.agents.driving import BRAKING_MPS2, HASTE_MPS2, Course, stopping_from
from cavsumo.agents.manoeuvres import (
    ARRIVED_M,
    Brake,
    CutIn,
    EgoPrediction,
    MakeManoeuvre,
    Run,
)
from cavsumo.agents.triggers import MAX_DECEL
from cavsumo.model.bodies import Action
from cavsumo.model.carriageway import Approach
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState
from cavsumo.model.zone_presence import drift

SLOW_MPS = 0.05  # a vehicle so slow stands
HARD_MPS2 = 8.0  # brake with all effort; without any driving.BRAKING_MPS2
GENTLE_MPS2 = 1.0  # throttle without effort; with all of it driving.HASTE_MPS2
CHANGE_S = (1.8, 1.0)  # the pursued point of a change of lanes, without and with all effort
CHANGING = 0.7  # share of its speed that it keeps at least until it has changed
NEAREST_M = 5.0  # that point is no nearer
SAME_MPS = 0.3  # an ego faster by no more than this follows
FOLLOWING_S = 3.0  # if it is so near
ENDED_S = 3.0  # it drives lawfully so long after it went on


class DriveProgramme(NamedTuple):
    """The programme of one vehicle.

    Attributes:
        cue: it begins when an ego that keeps its speed will be in this zone as they meet, or after
            this reaction of the ego (``cues``).
        speed: of the first leg [m/s].
        effort: how hard it accelerates, brakes and turns, from 0 to 1.
        depth: where it stops: how far its front is beyond the edge of the ego's strip, negative
            before it [m]. None: it does not stop. On the ego's lane and beside it any number means
            that it stops.
        pause: how long it then stands at least [s].
        resume: it stands on until this cue; None: no longer.
        speed_2: with which it goes on [m/s].
        delay, every, phase: as of a ``programme.WalkProgramme``.
    """

    cue: Cue
    speed: float
    effort: float
    depth: float | None
    pause: float
    resume: Cue | None
    speed_2: float
    delay: float = 0.0
    every: float = 0.0
    phase: float = 0.0

    @property
    def gaining(self) -> float:
        """Throttle [m/s2]."""
        return GENTLE_MPS2 + self.effort * (HASTE_MPS2 - GENTLE_MPS2)

    @property
    def braking(self) -> float:
        """Brake [m/s2]."""
        return BRAKING_MPS2 + self.effort * (HARD_MPS2 - BRAKING_MPS2)

    @property
    def hesitates(self) -> bool:
        """Whether it stops before the ego's way for a fixed time."""
        return self.depth is not None and self.depth < 0.0 and self.resume is None


class Legs:
    """Progress of a manoeuvre of two legs.

    Nobody drives into the side of an ego that is before him: that would be no test of the ego.

    Attributes:
        stands: whether the first leg has ended.
        second: whether the second one has begun.
    """

    stands = second = False
    minds_ego = True

    def go_on(self) -> None:
        """Begin the second leg."""
        self.second = True


class ProgrammedRun(Legs, Run):
    """Drives on against lights and signs; may stop before the ego's way or in it, and go on."""

    def __init__(
        self, scene: Scene, approach: Approach, course: Course, programme: DriveProgramme
    ) -> None:
        first, self._then = (
            Course(approach.path, course.kind, scene.dt, min(approach.speed, v))
            for v in (programme.speed, programme.speed_2)
        )
        super().__init__(scene, approach, first)
        self.gaining, self._depth, self._pause = programme.gaining, programme.depth, programme.pause
        self._hesitates = programme.hesitates
        self._from_rest: tuple[float, float] | None = None
        self._last: tuple[BodyState, tuple[float, float]] | None = None

    def arrival(self, state: BodyState) -> tuple[float, float]:
        """As of any run; of one that hesitates with its stop, after which it goes on."""
        if self._last is None or self._last[0] is not state:  # it is asked for twice
            self._last = state, self._arrival(state)
        return self._last[1]

    def _arrival(self, state: BodyState) -> tuple[float, float]:
        if self._depth is None or not self._hesitates or self.stands:
            return super().arrival(state)
        stop = max(self.approach.enter + self._depth, self.approach.wait)
        if self._from_rest is None:
            x, y, o = self.approach.path.at(stop)
            rest = BodyState(state.body, x, y, 0.0, o)
            self._from_rest = self._then.time_to(rest, self.approach.enter, self.gaining)
        time, v = self.course.time_to(state, stop, self.gaining)
        slowing = v / (2.0 * BRAKING_MPS2)  # longer than at the speed before
        return time + slowing + self._pause + self._from_rest[0], self._from_rest[1]

    def act(self, state: BodyState, others: Iterator[BodyState]) -> Action:
        allowed = self.course.room(state, others)
        if self._depth is not None and not self.second:
            dt = self.scene.dt
            left = self.approach.enter + self._depth - self.course.place(state)[0]
            allowed = min(allowed, stopping_from(left - state.v * dt, 0.0, dt))
            self.stands = max(state.v, allowed) <= SLOW_MPS
            self.course = self._then if self.stands else self.course
        return self.course.drive(state, allowed, gaining=self.gaining)


class Followed(Legs):
    """A manoeuvre ahead of an ego that comes closer, or that follows already."""

    def followed(self, ego: EgoPrediction, state: BodyState, gap: float) -> bool:
        """Whether the ego comes no closer to a vehicle at a gap [m]."""
        return ego.v <= state.v + SAME_MPS and 0.0 < gap <= FOLLOWING_S * ego.v


class ProgrammedBrake(Followed, Brake):
    """Brakes ahead of the ego, to a stand or to a speed, and goes on."""

    def __init__(
        self, scene: Scene, approach: Approach, course: Course, programme: DriveProgramme
    ) -> None:
        super().__init__(scene, approach, course)
        self._programme = programme
        self._wanted = programme.speed if programme.depth is None else 0.0

    def gap(self, ego: EgoPrediction, state: BodyState) -> tuple[float, float] | None:
        """The present one, as the stopping zones count it."""
        rear = self.course.place(state)[0] - state.body.kind.length / 2
        return rear + drift(state.v, ego.v, MAX_DECEL) - ego.front, ego.v

    def act(self, state: BodyState, others: Iterator[BodyState]) -> Action:
        programme, dt = self._programme, self.scene.dt
        if self.second:
            self.standing += dt
            allowed = min(programme.speed_2, self.course.room(state, others))
            return self.course.drive(state, allowed, gaining=programme.gaining)
        self.stands = state.v <= self._wanted + SLOW_MPS
        return Action(min(0.0, (self._wanted - state.v) / dt), self.course.steering(state))

    def over(self, state: BodyState) -> bool:
        return self.standing > ENDED_S


class ProgrammedCutIn(Followed, CutIn):
    """Changes into the ego's lane, brakes there to a speed or to a stand, and goes on."""

    def __init__(
        self, scene: Scene, approach: Approach, course: Course, programme: DriveProgramme
    ) -> None:
        super().__init__(scene, approach, course)
        self._programme, self._changing = programme, 0.0

    def begin(self, state: BodyState) -> None:
        super().begin(state)
        self._changing = max(CHANGING * state.v, self._programme.speed)
        top = max(self._changing, self._programme.speed_2)
        self.course = Course(self.course.path, state.body.kind, self.scene.dt, top)

    def act(self, state: BodyState, others: Iterator[BodyState]) -> Action:
        self.arrived = self.arrived or abs(self.course.place(state)[1]) < ARRIVED_M
        wanted = self._wanted()
        self.stands = self.arrived and state.v <= wanted + SLOW_MPS
        return self.course.drive(
            state,
            min(wanted, self.course.room(state, others)),
            gaining=self._programme.gaining,
            look=0.0 if self.arrived else self.look(state),
        )

    def look(self, state: BodyState) -> float:
        slow, fast = CHANGE_S
        return max(NEAREST_M, state.v * (slow + self._programme.effort * (fast - slow)))

    def _wanted(self) -> float:
        """The speed of the present leg [m/s]."""
        if not self.arrived:
            return self._changing
        if self.second:
            return self._programme.speed_2
        return self._programme.speed if self._programme.depth is None else 0.0


MANOEUVRES = (ProgrammedRun, ProgrammedBrake, ProgrammedCutIn)


def programmed_manoeuvre(type_: str, programme: DriveProgramme) -> MakeManoeuvre:
    """The programmed manoeuvre of a type of approach."""
    made = next(one for one in MANOEUVRES if type_ in one.types)
    return partial(made, programme=programme)
