"""Collision avoidance of pedestrians: they stop before other bodies, wait, and go round.

A body takes an action only if it could still stop afterwards before all bodies ahead of it;
otherwise it brakes. The check uses boxes: the area that it covers while it stops, against the
positions of the others now and after that time. Of two testers the later one in the order of the
scenario yields; the other one relies on that. The waiting time is bounded: then a body that crosses
a road goes round the obstacle, and one on a pavement turns back (``agents.behaviours``).

No tester avoids the moving ego: the test is whether the ego avoids the testers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from cavsumo.agents.walking import walk
from cavsumo.model.bodies import Action
from cavsumo.model.geometry import Box, gap, overlap
from cavsumo.model.kinematics import step_floats, wrap
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import AROUND_M, BodyState, Snapshot
from cavsumo.model.stopping_way import is_clear, stopping_way, stretched

KEEP_M = 0.65  # distance kept to a body ahead: enough to turn back
START_M = 0.3  # additional distance before a standing body walks on, or it would creep up
# Boxes are larger than people: allowed overlap of two boxes at each side [m] (``validity.DEEP_M``).
BRUSH_TESTER_M, BRUSH_M = 0.15, 0.05
DEEPEST = 1.8  # a body that turns inside an overlap gets at most so many times deeper
PATIENCE_S, YIELDING_S = 4.0, 2.0  # waiting time of the tester that yields, and of the other one
ROUND_S = 12.0  # a longer way round is given up
ROUND_MPS = 0.7  # speed on the way round
CLEAR_M = 2.0  # distance ahead that must be clear for a free way
CREEPING_MPS = 0.3  # a slower body still counts as waiting
STILL_MPS = 0.1  # a slower ego stands


class Avoidance:
    """Collision avoidance of one pedestrian, in one episode.

    Attributes:
        waited: time for which it has been blocked [s].
        tired: whether it has waited too long.
    """

    def __init__(self, scene: Scene, index: int) -> None:
        self.scene, self.index = scene, index
        self.waited, self.tired = 0.0, False
        self._turning: float | None = None  # the heading from which it turns back
        self._until: float | None = None  # when it gives up going round, and on which side it goes
        self._side = 1.0

    def along(self, snapshot: Snapshot, state: BodyState, wanted: Action) -> Action:
        """The wanted action, or a brake if that leads into another body."""
        if self._turning is not None and abs(wrap(state.o - self._turning)) > math.pi / 2:
            self._turning = None
        blocker = self._blocker(snapshot, state, wanted, close=self._turning is not None)
        if blocker is None:
            if state.v > CREEPING_MPS or wanted.throttle <= 0.0:
                self.waited, self.tired = 0.0, False
            return wanted
        self.waited += self.scene.dt
        first = any(t.id == blocker.id for t in snapshot.testers[: self.index])
        self.tired = self.waited > (YIELDING_S if first else PATIENCE_S)
        self._side = -1.0 if _aside(state, blocker) >= 0.0 else 1.0
        return _brake(state, self.scene.dt)

    def across(
        self, snapshot: Snapshot, state: BodyState, wanted: Action, heading: float
    ) -> Action:
        """The same on a way with that heading, and round a body that stays in it."""
        if state.v <= 0.0 and wanted.throttle <= 0.0:
            self.rest()
        if self._until is None:
            action = self.along(snapshot, state, wanted)
            if not self.tired:
                return action
            self._until, self.waited = snapshot.time + ROUND_S, 0.0
        ahead = stretched(_narrow(state.box._replace(heading=heading), BRUSH_M), CLEAR_M)
        boxes = (other.box for other, _, _ in self._others(snapshot, state))
        if is_clear(ahead, boxes) or snapshot.time > self._until:
            self.rest()
            return self.along(snapshot, state, wanted)
        aside = walk(state, heading + self._side * math.pi / 2, ROUND_MPS, self.scene.dt)
        if self._blocker(snapshot, state, aside, close=True) is None:
            self.waited = 0.0
            return aside
        self.waited += self.scene.dt
        if self.waited > YIELDING_S:  # then on the other side
            self._side, self.waited = -self._side, 0.0
        return _brake(state, self.scene.dt)

    @property
    def at_rest(self) -> bool:
        """Whether it has not waited and is not turning."""
        return self._turning is None and not self.waited and not self.tired

    def rest(self) -> None:
        """Reset the waiting time."""
        self._until = self._turning = None
        self.waited, self.tired = 0.0, False

    def turn_back(self, state: BodyState) -> None:
        """Let it turn on the spot, close to the body ahead."""
        self.rest()
        self._turning = state.o

    def _blocker(
        self, snapshot: Snapshot, state: BodyState, action: Action, *, close: bool
    ) -> BodyState | None:
        """The body before which this one could not stop any more after an action.

        ``close``: a body ahead may be passed very closely, and left if the boxes overlap.
        """
        body, x, y, v, o = state
        if v <= 0.0 and action.throttle <= 0.0:
            return None
        near = tuple(self._others(snapshot, state))
        if not near:
            return None
        kind, dt = body.kind, self.scene.dt
        keep = 0.0 if close else KEEP_M + (START_M if v <= 0.0 else 0.0)
        limits = kind.wheelbase, kind.v_min, kind.v_max, dt
        after = BodyState(body, *step_floats(x, y, v, o, *action, *limits))
        for other, brush, yields in near:
            enters = any(
                overlap(_shrunk(after.box, d), other.box)
                and not overlap(_shrunk(state.box, d), other.box)
                for d in (brush, DEEPEST * brush)
            )
            if close and not enters and overlap(_shrunk(state.box, brush), other.box):
                continue  # it turns to leave
            met = enters or _comes_to(after, other, keep, brush, yields, dt)
            if met and gap(state.box, other.box) <= AROUND_M:
                return other
        return None

    def _others(
        self, snapshot: Snapshot, state: BodyState
    ) -> Iterator[tuple[BodyState, float, bool]]:
        """The bodies near: the allowed overlap with each [m] and whether it will stop."""
        x, y, near = state.x, state.y, state.body.kind.reach + AROUND_M
        for i, tester in enumerate(snapshot.testers):
            reach = near + tester.body.kind.reach
            if abs(tester.x - x) > reach or abs(tester.y - y) > reach or i == self.index:
                continue
            if not (snapshot.unseen and tester.id in snapshot.unseen):
                yield tester, BRUSH_TESTER_M, i > self.index
        for raw in snapshot.raw_background:
            reach = near + raw[0].kind.reach
            if abs(raw[1] - x) <= reach and abs(raw[2] - y) <= reach:
                yield BodyState._make(raw), BRUSH_M, False
        if snapshot.ego.v <= STILL_MPS and snapshot.sees_ego:
            yield snapshot.ego, BRUSH_M, False


def _comes_to(
    state: BodyState, other: BodyState, keep: float, brush: float, yields: bool, dt: float
) -> bool:
    """Whether a body that stops comes nearer to another one ahead than ``keep`` [m]."""
    kind, cos, sin = state.body.kind, math.cos(state.o), math.sin(state.o)
    quarter, there = kind.length / 4, other.box
    half = Box(state.x + quarter * cos, state.y + quarter * sin, state.o, 2 * quarter, kind.width)
    if (other.x - state.x) * cos + (other.y - state.y) * sin > 0.0:
        stops = dt - state.v / kind.throttle_min  # until then the other goes on, or stops too [s]
        onward = stopping_way(other.body.kind, other.v, dt) if yields else other.v * stops
        there = stretched(there, onward)
    return overlap(stretched(_narrow(half, brush), stopping_way(kind, state.v, dt) + keep), there)


def _shrunk(box: Box, by: float) -> Box:
    """A box smaller by a depth on all sides [m]: it touches those that the box overlaps deeper."""
    return box._replace(length=box.length - 2.0 * by, width=box.width - 2.0 * by)


def _narrow(box: Box, brush: float) -> Box:
    """A box narrower by a depth on either side [m]."""
    return box._replace(width=box.width - 2.0 * brush)


def _aside(state: BodyState, other: BodyState) -> float:
    """Lateral offset of another body from the way straight on, positive to the left [m]."""
    return (other.y - state.y) * math.cos(state.o) - (other.x - state.x) * math.sin(state.o)


def _brake(state: BodyState, dt: float) -> Action:
    """Full braking, without a turn."""
    return Action(max(state.body.kind.throttle_min, -state.v / dt), 0.0)
