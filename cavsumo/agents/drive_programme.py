"""A vehicle's programme: a manoeuvre of its approach, begun by a cue of the ego.

A programme is a few numbers, so that a search can vary it (``searchers.drives``). The approach on
which the vehicle starts decides what they mean: it runs the line, creeps over it, hesitates or
stands in the ego's way; it brakes ahead of the ego; or it cuts in from the lane beside and slows
down. Before and after that it drives lawfully (``manoeuvres.Driver``). Its speed, throttle and turn
stay within those of ordinary drivers, which are narrower than those of its kind.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

from cavsumo.agents.cues import Awaited, Cue, EgoReactions, in_phase, zone_m
from cavsumo.agents.driving import (
    BRAKING_MPS2,
    HASTE_MPS2,
    Course,
    extent,
    stopping_from,
    within_turn,
)
from cavsumo.agents.manoeuvres import (
    ARRIVED_M,
    Brake,
    CutIn,
    Driver,
    EgoPrediction,
    MakeManoeuvre,
    Run,
)
from cavsumo.model.bodies import Action
from cavsumo.model.carriageway import Approach
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

LONGEST_STAND_S = 8.0  # a vehicle that waits for the ego goes on after this time
SLOW_MPS = 0.05  # a vehicle so slow stands
HARD_MPS2 = 8.0  # brake with all effort; without any driving.BRAKING_MPS2
GENTLE_MPS2 = 1.0  # throttle without effort; with all of it driving.HASTE_MPS2
SIDEWAYS_MPS2 = 5.0  # largest acceleration sideways: half of what dry tyres hold
CHANGE_S = (1.8, 1.0)  # the pursued point of a change of lanes, without and with all effort
NEAREST_M = 5.0  # that point is no nearer
LATE_S = (
    0.3  # a vehicle that would come so much later than its cue says drives up to the line first
)
AT_LINE_M = 1.0  # a vehicle so near to its line waits there
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


class Pause:
    """The time from standing until going on, in one episode."""

    def __init__(self, programme: DriveProgramme) -> None:
        self.programme = programme
        self.begun: float | None = None
        self._awaited: Awaited | None = None

    def over(self, snapshot: Snapshot, reactions: EgoReactions, gap: float) -> bool:
        """Whether it goes on; the pause begins with the first question.

        ``gap``: that the ego has left as they meet [m].
        """
        programme, time = self.programme, snapshot.time
        if self.begun is None:
            self.begun = time
            if isinstance(programme.resume, str):
                self._awaited = Awaited(programme.resume)
        reacted = self._awaited is not None and self._awaited.came(reactions, time)
        waited = time - self.begun
        if waited < programme.pause - 1e-9:
            return False
        if programme.resume is None or waited >= LONGEST_STAND_S:
            return True
        if isinstance(programme.resume, str):
            return reacted
        return gap <= zone_m(programme.resume, snapshot.ego.v)


class Legs:
    """Progress of a manoeuvre of two legs.

    Attributes:
        stands: whether the first leg has ended.
        second: whether the second one has begun.
    """

    stands = second = False

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
        self.gaining, self._depth = programme.gaining, programme.depth

    def act(self, state: BodyState, others: Iterator[BodyState]) -> Action:
        allowed = self.course.room(state, others)
        if self._depth is not None and not self.second:
            dt = self.scene.dt
            left = self.approach.enter + self._depth - self.course.place(state)[0]
            allowed = min(allowed, stopping_from(left - state.v * dt, 0.0, dt))
            self.stands = max(state.v, allowed) <= SLOW_MPS
            self.course = self._then if self.stands else self.course
        return self.course.drive(state, allowed, gaining=self.gaining)


class ProgrammedBrake(Legs, Brake):
    """Brakes ahead of the ego, to a stand or to a speed, and goes on."""

    def __init__(
        self, scene: Scene, approach: Approach, course: Course, programme: DriveProgramme
    ) -> None:
        super().__init__(scene, approach, course)
        self._programme = programme
        self._wanted = programme.speed if programme.depth is None else 0.0

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


class ProgrammedCutIn(Legs, CutIn):
    """Changes into the ego's lane at a speed, then goes on at another or stops for a while."""

    def __init__(
        self, scene: Scene, approach: Approach, course: Course, programme: DriveProgramme
    ) -> None:
        super().__init__(scene, approach, course)
        self._programme = programme

    def begin(self, state: BodyState) -> None:
        super().begin(state)
        top = max(self._programme.speed, self._programme.speed_2)
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
        if self.second:
            return self._programme.speed_2
        stops = self.arrived and self._programme.depth is not None
        return 0.0 if stops else self._programme.speed


MANOEUVRES = (ProgrammedRun, ProgrammedBrake, ProgrammedCutIn)


class ProgrammedDrive:
    """One vehicle that follows its programme, in one episode; without one it drives lawfully."""

    def __init__(self, scene: Scene, index: int, programme: DriveProgramme | None) -> None:
        approach = scene.starts[index].approach
        assert approach is not None
        self.scene, self.programme, self._driver = (
            scene,
            programme,
            Driver(scene, index, "lawful", programme and _manoeuvre(approach.type, programme)),
        )
        self._ego = EgoPrediction(scene, approach.ego_speed)
        self._reactions = EgoReactions()
        self._approach, self._late = approach, False
        if programme is not None:
            self._pause = Pause(programme)
            cue = programme.cue
            self._awaited = Awaited(cue, programme.delay) if isinstance(cue, str) else None

    def action(self, snapshot: Snapshot, state: BodyState) -> Action:
        """The next action."""
        driver, programme = self._driver, self.programme
        self._reactions.see(snapshot)
        if snapshot.sees_ego:
            self._ego.see(snapshot)
        if programme is None:
            return driver.idle(snapshot, state)
        if driver.active and driver.over(state):
            driver.end()
        due = driver.active or self._due(snapshot, state, programme)
        if not driver.active and not (due and driver.begin(state)):
            return driver.idle(snapshot, state, hurry=self._late)
        legs = driver.manoeuvre
        assert isinstance(legs, Legs)
        if legs.stands and not legs.second:
            gap = self._gap(snapshot, state)
            if self._pause.over(snapshot, self._reactions, gap):
                legs.go_on()
        wanted = driver.act(snapshot, state)
        throttle = max(-programme.braking, wanted.throttle)
        return within_turn(wanted._replace(throttle=throttle), state, SIDEWAYS_MPS2)

    def _due(self, snapshot: Snapshot, state: BodyState, programme: DriveProgramme) -> bool:
        """Whether the vehicle begins now."""
        if not snapshot.sees_ego:
            return False
        if self._awaited is not None:
            return self._awaited.came(self._reactions, snapshot.time)
        assert self._driver.manoeuvre is not None
        assert not isinstance(programme.cue, str)
        meeting = self._driver.manoeuvre.gap(self._ego, state)
        if meeting is None:
            return False
        gap, v = meeting
        most, half = zone_m(programme.cue, v), programme.every / 2
        self._late = gap < most - v * (LATE_S + half) and self._can_hurry(state)
        in_time = gap <= most + v * half and not self._late
        return in_time and in_phase(snapshot.time, programme.phase, programme.every, self.scene.dt)

    def _can_hurry(self, state: BodyState) -> bool:
        """Whether it has not yet come to where it waits, so that it can still gain time."""
        approach = self._approach
        here = self._driver.course.place(state)[0]
        return math.isfinite(approach.wait) and here < approach.wait - AT_LINE_M

    def _gap(self, snapshot: Snapshot, state: BodyState) -> float:
        """The gap that the ego has left as they meet if the vehicle goes on now [m].

        Where it stands in the ego's way, that to the vehicle along the ego's path.
        """
        assert self._driver.manoeuvre is not None
        meeting = self._driver.manoeuvre.gap(self._ego, state)
        if isinstance(self._driver.manoeuvre, ProgrammedRun) and meeting is not None:
            return meeting[0]
        here = self.scene.ego_path.project(state.x, state.y).along
        reach = extent(state, self.scene.ego_path.at(here)[2])[0]
        return here - reach - self.scene.ego.kind.length / 2 - self.scene.ego_progress(snapshot)


def _manoeuvre(type_: str, programme: DriveProgramme) -> MakeManoeuvre:
    """The programmed manoeuvre of a type of approach."""
    made = next(one for one in MANOEUVRES if type_ in one.types)
    return partial(made, programme=programme)
