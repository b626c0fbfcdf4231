"""Testers that a storyboard moves: its events begin when their conditions hold.

A place is fixed two timesteps ahead (``agents.scripted``), so a condition that will hold within
these is foreseen: its quantity is taken to change as evenly as in the last timestep. Conditions of
time and distance therefore hold at their moments and not only at the next timestep.

An action replaces what its body did before. A body that is to arrive with the ego commits once, as
all programmed bodies do: it does not adapt to what the ego does afterwards.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from cavsumo.agents.story_conditions import BoardView, ConditionWatch
from cavsumo.errors import AgentError
from cavsumo.model.curve import PlaneCurve, Pose
from cavsumo.model.motion import Motion
from cavsumo.model.scenario.script import Programme, ScriptedTest
from cavsumo.model.scenario.storyboard import StoryAction, StoryEvent, StoryTrigger
from cavsumo.model.scenario.track import Place, ScriptedTrack


class MotionSegment(NamedTuple):
    """A part of a body's motion: from a moment [s] on, at a distance on its way [m]."""

    begins: float
    ahead: float
    motion: Motion


@dataclass
class StoryBody:
    """A body of a storyboard in one episode: where it is at any time that is decided.

    Attributes:
        id: of the body.
        programme: its box, its way and its first speed.
        segments: of its motion along its way.
        track: that it follows in place of them, from the moment ``since`` on.
        arrival: by which it will commit; with the event of which it is.
    """

    id: str
    programme: Programme
    segments: list[MotionSegment] = field(default_factory=list)
    track: ScriptedTrack | None = None
    since: float = math.inf
    arrival: tuple[StoryAction, int] | None = None
    curve: PlaneCurve = field(init=False)

    def __post_init__(self) -> None:
        self.curve = self.programme.way.curve
        self.segments = [MotionSegment(-math.inf, 0.0, Motion(self.programme.speed_mps))]

    def along(self, time: float) -> tuple[float, float]:
        """Distance on its way [m] and speed [m/s] at a time."""
        one = next(s for s in reversed(self.segments) if s.begins <= time or s.begins < 0.0)
        begins = max(0.0, one.begins)
        s, v = one.motion.at(time - begins)
        return one.ahead + s, v

    def place(self, time: float) -> Place:
        """Where its middle is at a time."""
        if self.track is not None and time >= self.since:
            return self.track.at(time - self.since)
        return self.curve.at(self.along(time)[0])[:2]

    def pose(self, time: float) -> tuple[Pose, float]:
        """Its pose and speed at a time, for a rehearsal without kinematics."""
        s, v = self.along(time)
        if self.track is None or time < self.since:
            return self.curve.at(s), v
        (x, y), (x1, y1) = self.place(time), self.place(time + self.track.every_s)
        moved = math.dist((x, y), (x1, y1))
        heading = math.atan2(y1 - y, x1 - x) if moved else self.track.heading
        return (x, y, heading), moved / self.track.every_s

    def change(self, moment: float, motion: Motion) -> None:
        """Begin another motion."""
        self.segments.append(MotionSegment(moment, self.along(moment)[0], motion))


class StoryRun:
    """A storyboard in one episode.

    Args:
        script: with the storyboard.
        dt: length of a timestep [s].

    Attributes:
        bodies: those of the testers, in their order.
        stopped: whether a stop trigger holds at the next timestep.
    """

    def __init__(self, script: ScriptedTest, dt: float) -> None:
        assert script.board is not None
        self.dt, self.board, self.stopped = dt, script.board, False
        self.bodies = [
            StoryBody(body.id, one) for body, one in zip(script.bodies, script.testers, strict=True)
        ]
        self._by_id = {body.id: body for body in self.bodies}
        events = self.board.events
        self._begun = [math.inf] * len(events)
        self._ends: list[list[float]] = [[math.inf] * len(event.actions) for event in events]
        self._owner: dict[str, tuple[int, int]] = {}
        self._stopped: set[int] = set()
        self.variables = dict(self.board.variables)
        triggers = [t for event in events for t in (*event.starts, event.stops)]
        self._watches = {
            condition: ConditionWatch(condition, self)
            for trigger in (*triggers, self.board.stops)
            for group in trigger
            for condition in group
        }

    def advance(self, seen: BoardView) -> None:
        """Begin what begins within the next two timesteps."""
        for watch in self._watches.values():
            watch.look(seen, self.dt)
        self._arrive(seen)
        self._stop_acts(seen.time)
        # An event that ends at once may let another one begin at the same moment.
        for _ in self.board.events:
            begun = [self._started(i, seen) for i in range(len(self.board.events))]
            if not any(begun):
                break
        if self.board.stops:
            self.stopped = self._moment(self.board.stops, seen.time) <= seen.time + self.dt

    def state_moment(self, element: str, state: str) -> tuple[float, float]:
        """From when until when an element of the storyboard is in a state [s]."""
        inside = [i for i, e in enumerate(self.board.events) if element in (e.name, *e.within)]
        begins = min((self._begun[i] for i in inside), default=math.inf)
        ends = max((self._end(i) for i in inside), default=math.inf)
        if state == "standbyState":
            return 0.0, begins
        if state == "runningState":
            return begins, ends
        if state == "startTransition":
            return begins, begins
        return ends, ends if state == "endTransition" else math.inf

    def _end(self, event: int) -> float:
        """When an event ends, as far as that is known."""
        return max(self._ends[event], default=self._begun[event])

    # Events

    def _started(self, i: int, seen: BoardView) -> bool:
        """Begin an event if its triggers hold soon; whether it did."""
        event, time = self.board.events[i], seen.time
        if self._begun[i] < math.inf or i in self._stopped:
            return False
        moment = max((self._moment(t, time) for t in event.starts), default=0.0)
        if moment >= time + 2 * self.dt:
            return False
        self._begun[i] = start = max(moment, time + self.dt) if time > 0.0 else max(moment, 0.0)
        if event.overrides:
            self._end_others(i, event, start)
        for k, action in enumerate(event.actions):
            self._ends[i][k] = self._begin(action, (i, k), max(start, time + self.dt))
        self._arrive(seen)
        return True

    def _moment(self, trigger: StoryTrigger, time: float) -> float:
        """From when on a trigger holds; infinite if not within two timesteps."""
        groups = (max(self._watches[one].moment(time, self.dt) for one in g) for g in trigger)
        return min(groups, default=0.0)

    def _end_others(self, i: int, event: StoryEvent, start: float) -> None:
        """End the running events of the same manoeuvre."""
        for k, other in enumerate(self.board.events):
            if k != i and other.within == event.within and self._begun[k] < math.inf:
                self._ends[k] = [min(end, start) for end in self._ends[k]]
                self._release(k)

    def _stop_acts(self, time: float) -> None:
        """End the events of acts that a trigger stops; their bodies keep their speeds."""
        for i, event in enumerate(self.board.events):
            if not event.stops or i in self._stopped:
                continue
            moment = self._moment(event.stops, time)
            if moment < time + 2 * self.dt:
                self._stopped.add(i)
                start = max(moment, time + self.dt)
                self._release(i)
                for body, (owner, k) in self._owner.items():
                    if owner == i and self._ends[i][k] > start:
                        own = self._by_id[body]
                        own.change(start, Motion(own.along(start)[1]))
                self._ends[i] = [min(end, start) for end in self._ends[i]]

    def _release(self, event: int) -> None:
        """Forget what an event has not yet committed to."""
        for body in self.bodies:
            if body.arrival is not None and body.arrival[1] == event:
                body.arrival = None

    def _begin(self, action: StoryAction, key: tuple[int, int], start: float) -> float:
        """Begin an action; returns when it ends, as far as that is known."""
        if action.variable:
            self.variables[action.variable] = action.word
            return start
        body = self._by_id[action.body]
        if (before := self._owner.get(body.id)) is not None:
            i, k = before
            self._ends[i][k] = min(self._ends[i][k], start)
        self._owner[body.id], body.arrival = key, None
        if action.track is not None:
            body.track, body.since = action.track, start
            return start + action.track.every_s * (len(action.track.points_m) - 1)
        if action.ego_at_m is not None:
            body.arrival = action, key[0]
            return math.inf
        return self._changed(body, action, start)

    def _changed(self, body: StoryBody, action: StoryAction, start: float) -> float:
        """Begin a change of speed."""
        motion = action.change(body.along(start)[1])
        body.change(start, motion)
        return start + sum(phase.duration for phase in motion.phases)

    # Bodies that arrive with the ego

    def _arrive(self, seen: BoardView) -> None:
        """Let the bodies commit that have to within the next two timesteps."""
        for body in self.bodies:
            if body.arrival is not None:
                self._commit(body, *body.arrival, seen)

    def _commit(self, body: StoryBody, action: StoryAction, event: int, seen: BoardView) -> None:
        """Fix the motion of a body that must begin now to arrive with the ego."""
        assert action.ego_at_m is not None
        assert action.own_at_m is not None
        gone, v = body.along(seen.time)
        left = action.ego_at_m - seen.front
        arrives = seen.time + (
            left / seen.speed if seen.speed > 0.0 else math.copysign(math.inf, left)
        )
        needed = action.arrival(gone, v).when(action.own_at_m - gone)
        moment = arrives - needed
        if moment < seen.time + 2 * self.dt:
            start = max(moment, seen.time + self.dt, self._begun[event])
            gone, v = body.along(start)
            motion = action.hurried(gone, v, arrives - start) if moment < start else None
            if motion is None and start - moment > self.dt:
                raise AgentError(
                    f"{body.id} cannot arrive with the ego, which is there in "
                    f"{arrives - start:.1f} s"
                )
            body.change(start, motion or action.arrival(gone, v))
            body.arrival = None
            i, k = self._owner[body.id]
            self._ends[i][k] = max(arrives, start)
