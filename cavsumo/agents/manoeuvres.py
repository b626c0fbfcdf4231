"""The behaviour of a programmed vehicle: lawful until it is triggered, then its manoeuvre.

Lawful: it follows its lanes, keeps its distance to all bodies and, unless it is triggered, waits
where its way meets the ego's. It approaches slowly, so as to be still moving when the ego arrives.
On the ego's lane and beside it, it keeps the speed with which it started.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import ClassVar

from cavsumo.agents.driving import HASTE_MPS2, RUN_OUT_M, Course, stopping_from
from cavsumo.agents.red_lights import holds, red_along
from cavsumo.agents.triggers import MARGIN, MAX_DECEL, REACTION_TIME, Trigger
from cavsumo.model.bodies import NOOP, Action
from cavsumo.model.carriageway import Approach
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.model.zone_presence import drift

MANOEUVRES = ("auto", "run", "brake", "cut-in")
CREEPING_MPS = 2.0  # a lawful vehicle drives to its waiting point at least at this speed
STANDS_S = 3.0  # one that braked drives on after this time
NOTICE_S = 0.7  # an ego that follows is taken to notice a brake light after this time
STANDING_M = 2.5  # and to stop so far behind
CUT_IN_LOOK_M = 7.0  # how gently it changes lanes: the distance of the point pursued
SLOWED = 0.7  # speed after cutting in, as a share of the one before
SQUEEZE_M = 20.0  # a lane that ends so soon after leaving the ego's ends beside it
STOPPING_M = 30.0  # so far before the end of its way it considers the end again
ARRIVED_M = 0.3  # a body so near the axis of a lane is on it
MOVING_OFF = 0.7  # an ego slower than this share of its speed limit that gains speed moves off
BEFORE_LINE_M = 0.5  # it stops so far before a red light
FAR_M = 30.0  # a run that leads into the ego's lane has ended after this


class EgoPrediction:
    """Predicted positions of the ego: at its current speed, or gaining speed while it moves off."""

    def __init__(self, scene: Scene, limit: float) -> None:
        self.scene, self.limit = scene, limit
        self.front = self.v = self.gaining = 0.0
        self._seen = -2  # no timestep before the first one either

    def see(self, snapshot: Snapshot) -> None:
        """Take in a snapshot."""
        v, self._seen, before = snapshot.ego.v, snapshot.step, self._seen
        gained = (v - self.v) / self.scene.dt if snapshot.step - before == 1 else 0.0
        self.gaining = gained if v < MOVING_OFF * self.limit and gained > 0.0 else 0.0
        self.front, self.v = self.scene.ego_progress(snapshot) + self.scene.ego.kind.length / 2, v

    def after(self, time: float) -> tuple[float, float]:
        """Arc length of its front on its path, and its speed, after a time [m, m/s]."""
        if not self.gaining:
            return self.front + self.v * time, self.v
        gaining = min(time, (self.limit - self.v) / self.gaining)
        v = self.v + self.gaining * gaining
        return self.front + (self.v + v) / 2 * gaining + v * (time - gaining), v


class Manoeuvre:
    """One manoeuvre of one vehicle.

    Attributes:
        course: the course of the vehicle, before and after.
    """

    types: ClassVar[tuple[str, ...]]  # of approach on which it is possible
    minds_ego: ClassVar[bool] = False  # whether it brakes for an ego that is ahead on its way

    def __init__(self, scene: Scene, approach: Approach, course: Course) -> None:
        self.scene, self.approach, self.course = scene, approach, course

    def possible(self, state: BodyState) -> bool:
        """Whether it can still begin."""
        return True

    def begin(self, state: BodyState) -> None:
        """Begin."""

    def act(self, state: BodyState, others: Iterator[BodyState]) -> Action:
        """The next action; ``others`` are all, without an ego that it does not mind."""
        raise NotImplementedError

    def over(self, state: BodyState) -> bool:
        """Whether it has ended, and the vehicle drives lawfully on."""
        return False

    def gap(self, ego: EgoPrediction, state: BodyState) -> tuple[float, float] | None:
        """Gap that an ego which drives on has left on meeting a vehicle that begins now [m].

        With it the ego's speed then [m/s]. Measured as the stopping zones count vehicles
        (``zone_presence``). None when they will not meet.
        """
        raise NotImplementedError


class Run(Manoeuvre):
    """Drives on across or into the ego's way, against lights, signs and other traffic."""

    types = ("crossing", "merging")
    gaining = HASTE_MPS2  # throttle

    def possible(self, state: BodyState) -> bool:
        return self.course.place(state)[0] < self.approach.enter

    def act(self, state: BodyState, others: Iterator[BodyState]) -> Action:
        allowed = self.course.room(state, others)
        return self.course.drive(state, allowed, gaining=self.gaining)

    def over(self, state: BodyState) -> bool:
        end = min(self.approach.leave, self.approach.enter + FAR_M)
        return self.course.place(state)[0] > end

    def gap(self, ego: EgoPrediction, state: BodyState) -> tuple[float, float] | None:
        if not self.possible(state):
            return None
        approach, path = self.approach, self.scene.ego_path
        time, v = self.arrival(state)
        turn = self.course.path.at(approach.enter)[2] - path.at(approach.ego_enter)[2]
        front, ego_v = ego.after(time + self.scene.dt)
        return approach.ego_enter - front + drift(v * math.cos(turn), ego_v, MAX_DECEL), ego_v

    def arrival(self, state: BodyState) -> tuple[float, float]:
        """When and how fast a vehicle that begins now comes into the ego's way [s, m/s]."""
        return self.course.time_to(state, self.approach.enter, self.gaining)


class Brake(Manoeuvre):
    """Brakes as hard as it can, and stands for a while."""

    types = ("following",)
    standing = 0.0  # for how long [s]

    def act(self, state: BodyState, others: Iterator[BodyState]) -> Action:
        if state.v <= 0.0:
            self.standing += self.scene.dt
        return Action(state.body.kind.throttle_min, self.course.steering(state))

    def over(self, state: BodyState) -> bool:
        return self.standing > STANDS_S

    def gap(self, ego: EgoPrediction, state: BodyState) -> tuple[float, float] | None:
        rear = self.course.place(state)[0] - state.body.kind.length / 2
        front, ego_v = ego.after(NOTICE_S)
        return rear + drift(state.v, ego_v, MAX_DECEL) - front - STANDING_M, ego_v


class CutIn(Manoeuvre):
    """Changes into the ego's lane and slows down."""

    types = ("adjacent",)
    arrived = False  # in the ego's lane

    def possible(self, state: BodyState) -> bool:
        return self.arrived or self.course.place(state)[0] >= self.approach.enter

    def begin(self, state: BodyState) -> None:
        assert self.approach.into is not None
        top = max(state.v, CREEPING_MPS)
        self.course = Course(self.approach.into, state.body.kind, self.scene.dt, top)
        self.slowed = SLOWED * top

    def act(self, state: BodyState, others: Iterator[BodyState]) -> Action:
        self.arrived = self.arrived or abs(self.course.place(state)[1]) < ARRIVED_M
        allowed = self.course.room(state, others)
        if self.arrived:
            return self.course.drive(state, min(allowed, self.slowed))
        return self.course.drive(state, allowed, look=self.look(state))

    def look(self, state: BodyState) -> float:
        """The distance of the point pursued while it changes lanes [m]."""
        return CUT_IN_LOOK_M

    def over(self, state: BodyState) -> bool:
        end = self.course.path.length - STOPPING_M
        return self.arrived and self.course.place(state)[0] > end

    def gap(self, ego: EgoPrediction, state: BodyState) -> tuple[float, float] | None:
        here = self.scene.ego_path.project(state.x, state.y)
        kind = state.body.kind
        if state.v <= 0.0 or not 0.0 < here.along < self.scene.ego_path.length:
            return None
        # Pursuing a point at the distance L on a line, a body closes in on it as exp(-way / L).
        strips = (kind.width + self.scene.ego.kind.width) / 2
        time = self.look(state) * math.log(max(1.0, abs(here.lateral) / strips)) / state.v
        rear = here.along - kind.length / 2 + state.v * time
        front, ego_v = ego.after(time)
        return rear + drift(state.v, ego_v, MAX_DECEL) - front, ego_v


MakeManoeuvre = Callable[[Scene, Approach, Course], Manoeuvre]
KNOWN: Mapping[str, type[Manoeuvre]] = {"run": Run, "brake": Brake, "cut-in": CutIn}


def manoeuvre_on(name: str, type_: str) -> type[Manoeuvre] | None:
    """The manoeuvre of a name on a type of approach; "auto" is the one that is possible there."""
    for known, manoeuvre in KNOWN.items():
        if name in ("auto", known) and type_ in manoeuvre.types:
            return manoeuvre
    return None


def types_for(name: str) -> tuple[str, ...]:
    """The types of approach on which a manoeuvre is possible; empty for "auto"."""
    return () if name == "auto" else KNOWN[name].types


class Driver:
    """The behaviour of a programmed vehicle (``behaviours.Behaviour``).

    Args:
        idle: "noop" does nothing until it is triggered; any other word drives lawfully.
        chosen: makes its manoeuvre on its course; None: it drives lawfully throughout.
    """

    def __init__(self, scene: Scene, index: int, idle: str, chosen: MakeManoeuvre | None) -> None:
        approach = scene.starts[index].approach
        assert approach is not None
        self.scene, self.approach, self._noop = scene, approach, idle == "noop"
        kind = scene.bodies[index].kind
        waits = math.isfinite(approach.wait)
        top = approach.speed if waits else scene.starts[index].v or approach.speed
        self.course = Course(approach.path, kind, scene.dt, top)
        self.manoeuvre = chosen(scene, approach, self.course) if chosen else None
        self.active = self._begun = False
        # Beyond the end of a road SUMO's drivers do not see a body. There it is out of the way of
        # all but those behind it, so a vehicle ahead of the ego stops before that. So does a
        # vehicle beside it: where its lane ends it may be pushed into the ego's.
        self._run_out = RUN_OUT_M if waits else -kind.length / 2
        beside = not waits and math.isfinite(approach.leave)
        if beside and approach.path.length - approach.leave < SQUEEZE_M:
            self._run_out += approach.leave - approach.path.length

    def idle(self, snapshot: Snapshot, state: BodyState, *, hurry: bool = False) -> Action:
        """Drive lawfully, perhaps in a hurry up to where it waits; or do nothing yet."""
        if self._noop and not self._begun:
            return NOOP
        here, dt = self.course.place(state)[0], self.scene.dt
        left = self.course.path.length + self._run_out - here - state.v * dt
        allowed = self.course.room(state, everybody(snapshot, state))
        waits = math.isfinite(self.approach.wait)
        if waits and not self._begun and here < self.approach.enter:
            left = min(left, self.approach.wait - here - state.v * dt)
            allowed = min(allowed, math.inf if hurry else self._unhurried(snapshot, here))
        elif not waits:
            left = min(left, self._to_light(snapshot, state) - state.v * dt)
        return self.course.drive(state, min(allowed, stopping_from(left, 0.0, dt)))

    def _to_light(self, snapshot: Snapshot, state: BodyState) -> float:
        """How far it is to a red light of the ego's way at which a vehicle ahead can stop [m]."""
        if not self.scene.lights:
            return math.inf
        half = state.body.kind.length / 2
        front = self.scene.ego_path.project(state.x, state.y).along + half
        line = red_along(self.scene, snapshot, front)
        return line - BEFORE_LINE_M - front if holds(line, front, state.v) else math.inf

    def _unhurried(self, snapshot: Snapshot, here: float) -> float:
        """The speed that leads to the ego's way no sooner than the ego to it [m/s]."""
        ego = snapshot.ego
        way = self.approach.ego_enter - self.scene.ego_progress(snapshot) - ego.body.kind.length / 2
        if way <= 0.0 or ego.v <= CREEPING_MPS:
            return CREEPING_MPS
        return max(CREEPING_MPS, (self.approach.enter - here) * ego.v / way)

    def begin(self, state: BodyState) -> bool:
        """Begin the manoeuvre; False when there is none, it is too late, or it has begun before."""
        if not self.can_begin(state):
            return False
        assert self.manoeuvre is not None
        self.manoeuvre.begin(state)
        self.course = self.manoeuvre.course  # cutting in leads to another
        self.active = self._begun = True
        return True

    def can_begin(self, state: BodyState) -> bool:
        """Whether there is a manoeuvre, it has not begun before, and it is not too late for it."""
        return self.manoeuvre is not None and not self._begun and self.manoeuvre.possible(state)

    def over(self, state: BodyState) -> bool:
        """Whether the manoeuvre has ended."""
        return self.manoeuvre is not None and self.manoeuvre.over(state)

    def end(self) -> None:
        """Drive lawfully from now on."""
        self.active = False

    def act(self, snapshot: Snapshot, state: BodyState) -> Action:
        """The next action of the manoeuvre."""
        assert self.manoeuvre is not None
        others = everybody(snapshot, state, ego=self.manoeuvre.minds_ego)
        return self.manoeuvre.act(state, others)

    def timing(self, aim: float) -> Trigger:
        """The trigger that times the manoeuvre by the ego's arrival."""
        return Arrival(self, aim)


class Arrival:
    """Holds when a vehicle that begins now meets the ego as its reaction zone arrives there.

    See ``triggers.Timing`` for the part ``aim``.
    """

    def __init__(self, driver: Driver, aim: float) -> None:
        self.driver, self.aim = driver, aim
        self.ego = EgoPrediction(driver.scene, driver.approach.ego_speed)

    def __call__(self, snapshot: Snapshot, state: BodyState) -> bool:
        if self.driver.manoeuvre is None:
            return False
        self.ego.see(snapshot)
        meeting = self.driver.manoeuvre.gap(self.ego, state)
        if meeting is None:
            return False
        gap, v = meeting
        braking, reaction = 0.5 * v * v / MAX_DECEL, REACTION_TIME * v
        return braking + MARGIN * reaction < gap <= braking + self.aim * reaction


def everybody(snapshot: Snapshot, but: BodyState, *, ego: bool = True) -> Iterator[BodyState]:
    """All visible bodies but one, with the ego if wanted."""
    unseen = snapshot.unseen
    for other in snapshot.testers:
        if other is not but and not (unseen and other.id in unseen):
            yield other
    yield from map(BodyState._make, snapshot.raw_background)
    if ego and snapshot.sees_ego:
        yield snapshot.ego
