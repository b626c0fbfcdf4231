"""Testers that a storyboard moves: its events begin when their conditions hold.

A place is fixed two timesteps ahead (``agents.scripted``), so a condition that will hold within
these is foreseen: its quantity is taken to change as evenly as in the last timestep. Conditions of
time and distance therefore hold at their moments and not only at the next timestep.

An action replaces what its body did before. A body that is to arrive with the ego commits once, as
all programmed bodies do: it does not adapt to what the ego does afterwards.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from cavsumo.agents.story_body import StoryBody
from cavsumo.agents.story_conditions import BoardView, ConditionWatch
from cavsumo.errors import AgentError
from cavsumo.model.curve import Bend, PlaneCurve
from cavsumo.model.motion import Motion
from cavsumo.model.scenario.script import ScriptedTest
from cavsumo.model.scenario.storyboard import LEVELS, StoryAction, StoryEvent, StoryTrigger


class Turning(NamedTuple):
    """A body that follows another way: the action of an event, and how far it has then gone [m]."""

    event: int
    action: int
    body: StoryBody
    gone: float


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
        for body in self.bodies:
            body.paced = self._by_id.get(self.board.paces.get(body.id, ""))
        self._turnings: list[Turning] = []
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
        self._turned(seen.time)
        self._stop_acts(seen.time)
        # An event that ends at once may let another one begin at the same moment.
        for _ in self.board.events:
            begun = [self._started(i, seen) for i in range(len(self.board.events))]
            if not any(begun):
                break
        if self.board.stops:
            self.stopped = self._moment(self.board.stops, seen.time) <= seen.time + self.dt

    def state_moment(self, element: str, level: str, state: str) -> tuple[float, float]:
        """From when until when an element of the storyboard is in a state [s]."""
        at = LEVELS.index(level)
        places = [(*event.within, event.name) for event in self.board.events]
        inside = [i for i, names in enumerate(places) if names[at] == element]
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
        if action.legs:
            return self._turn(body, action, key, start)
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

    # Bodies that leave their way for another one

    def _turn(
        self, body: StoryBody, action: StoryAction, key: tuple[int, int], start: float
    ) -> float:
        """Let a body follow legs from its place on; its speed is left as it is."""
        (x, y, o), back = body.pose(start)[0], self.board.axles_m.get(body.id, 0.0)
        begin = x - back * math.cos(o), y - back * math.sin(o), o
        legs = [Bend(*leg) for leg in action.legs]
        for other in [one for one in self._turnings if one.body is body]:
            ends = self._ends[other.event]
            ends[other.action] = min(ends[other.action], start)
            self._turnings.remove(other)
        body.turn(start, PlaneCurve(begin, legs), back)
        gone = body.along(start)[0] + sum(leg.length for leg in legs)
        self._turnings.append(Turning(*key, body, gone))
        return body.when(gone)

    def _turned(self, time: float) -> None:
        """Say anew when legs end that have not ended, since speeds may have changed."""
        for event, action, body, gone in self._turnings:
            if self._ends[event][action] > time and event not in self._stopped:
                self._ends[event][action] = body.when(gone)

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
