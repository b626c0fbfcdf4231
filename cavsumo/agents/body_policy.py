"""The policy of one body from a solved game, planned again at every timestep.

The body goes to the kerb and waits there as long as a later start is equally sure: late tests leave
the ego less time to react, and use little of the road. On the road it walks on, or stands while
walking on would spoil the test. In the ego's way it stands until the ego has passed or has stopped;
then it walks to the other side.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from cavsumo.agents.planning.coordinates import Coordinates, Relative
from cavsumo.agents.planning.forceability import LEAST_MPS, Forceability
from cavsumo.agents.walking import ApproachKerb, walk
from cavsumo.model.bodies import Action
from cavsumo.model.kinematics import step_floats
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

PASSED_M = 1.0  # an ego whose rear is so far beyond the body is no longer a danger


class BodyPolicy:
    """The policy of one body; begin a new one for each episode.

    Args:
        forceabilities: that of the class of egos it plays against, followed by those of classes
            that it falls back on if it can force nothing against that one.
        escape: a heading relative to the way across on which it starts at once, for bodies that
            arrive too late on the straight way [rad]; None for the policy.

    Attributes:
        going: whether it has finally left the kerb.
    """

    def __init__(
        self,
        scene: Scene,
        index: int,
        forceabilities: Sequence[Forceability],
        escape: float | None = None,
    ) -> None:
        self.scene, self.index, self.forceabilities = scene, index, tuple(forceabilities)
        self.where = Coordinates(scene, index)
        self.kerb = ApproachKerb(scene, index)
        self.escape = escape
        self.going = escape is not None
        self._passed = -scene.ego.kind.length - scene.bodies[index].kind.width - PASSED_M

    @property
    def heading(self) -> float:
        """The heading of the way on which it goes [rad]."""
        way = self.scene.way(self.index)
        return (way.heading if way else self.scene.starts[self.index].o) + (self.escape or 0.0)

    def sure(self, snapshot: Snapshot) -> bool:
        """Whether the goal is sure from here, against the class of egos or a fallback."""
        here = self.where(snapshot)
        return here is not None and any(o.sure(here) for o in self.forceabilities)

    def lost(self, snapshot: Snapshot) -> bool:
        """Whether this body can no longer reach a test."""
        here = self.where(snapshot)
        if here is None or here.gap < self._passed:
            return True
        return here.left > 0.0 and not self.forceabilities[-1].possible(here)

    def due(self, snapshot: Snapshot, idle: Action) -> float:
        """The gain of starting now instead of idling: 1 if the test is sure now and would not be
        sure later, between 0 and 1 if it is uncertain, else 0.
        """
        here = self.where(snapshot)
        if here is None:
            return 0.0
        after = self._after(snapshot, here, idle)
        for forceability in self.forceabilities:
            if forceability.sure(after):
                return 0.0
            if forceability.sure(here):
                return 1.0
        last = self.forceabilities[-1]
        if not last.possible(here):
            return 0.0
        return max(0.0, min(0.5, last.worth(here) - last.worth(after)))

    def idle(self, snapshot: Snapshot) -> Action:
        """The action before the start."""
        return self.kerb.action(snapshot.testers[self.index])

    def go(self, snapshot: Snapshot) -> Action:
        """The action from the start on."""
        state, here, dt = snapshot.testers[self.index], self.where(snapshot), self.scene.dt
        met = self.where.meeting
        assert here is not None
        assert met is not None
        heading, top = met.way.heading, state.body.kind.v_max
        over = here.left < -met.width
        # An ego that stands belongs to no class: waiting for it could take for ever.
        if over or here.gap < self._passed or here.v <= LEAST_MPS:
            there = met.way.progress(state.x, state.y) >= met.way.length
            return walk(state, heading, 0.0 if there else top, dt)
        if self.escape is not None:
            return walk(state, heading + self.escape, 0.0 if self._touches(state) else top, dt)
        wanted = here.left > 0.0 and self.forceabilities[-1].possible(here)
        return walk(state, heading, top if wanted else 0.0, dt)

    def _after(self, snapshot: Snapshot, here: Relative, idle: Action) -> Relative:
        """The state after a timestep of idling, with an ego that keeps its speed."""
        state, dt = snapshot.testers[self.index], self.scene.dt
        gap = here.gap - here.v * dt
        if state.v == 0.0 and idle.throttle <= 0.0:
            return here._replace(gap=gap)
        kind = state.body.kind
        limits = kind.wheelbase, kind.v_min, kind.v_max, dt
        moved = BodyState(state.body, *step_floats(*state[1:], *idle, *limits))
        return here._replace(gap=gap, left=self.where.left(moved), walk=moved.v)

    def _touches(self, state: BodyState) -> bool:
        """Whether the body touches the strip that the ego sweeps, however it is turned."""
        met, kind = self.where.meeting, state.body.kind
        assert met is not None
        turn = state.o - met.way.heading
        reach = kind.length * abs(math.cos(turn)) + kind.width * abs(math.sin(turn))
        return met.way.progress(state.x, state.y) + reach / 2 >= met.strip + kind.length / 2
