"""How one body carries out the policy of a solved game, re-planned at every timestep.

It goes to the kerb and waits there as long as it can go later just as surely: late tests leave the
ego less time to react, and least of the road is used. Once on the road it walks on, or stands
while going on would spoil the test. In the ego's way it stands, until the ego has
passed or has stopped; then it goes on to the other side.
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

PASSED_M = 1.0  # how far behind the body the ego's rear must be to be no danger any more


class BodyPolicy:
    """The policy of one body; begin a new one for each episode.

    Args:
        forceabilities: the class of egos it plays against; behind it those that it falls back on
            where nothing can be forced against that one.
        escape: a heading relative to the way across on which it goes at once, for bodies that
            come too late on the straight way [rad]; None for the policy.

    Attributes:
        going: whether it has left the kerb for good.
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
        """Whether the goal is sure from here, against the class of egos or one fallen back on."""
        here = self.where(snapshot)
        return here is not None and any(o.sure(here) for o in self.forceabilities)

    def lost(self, snapshot: Snapshot) -> bool:
        """Whether this body will not come to a test any more."""
        here = self.where(snapshot)
        if here is None or here.gap < self._passed:
            return True
        return here.left > 0.0 and not self.forceabilities[-1].possible(here)

    def due(self, snapshot: Snapshot, idle: Action) -> float:
        """How much is to be gained by going now instead of idling: 1 where the test is sure now and
        would not be any more, something above 0 where it is uncertain, else 0.
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
        """What it does before it goes."""
        return self.kerb.action(snapshot.testers[self.index])

    def go(self, snapshot: Snapshot) -> Action:
        """What it does from then on."""
        state, here, dt = snapshot.testers[self.index], self.where(snapshot), self.scene.dt
        met = self.where.meeting
        assert here is not None
        assert met is not None
        heading, top = met.way.heading, state.body.kind.v_max
        over = here.left < -met.width
        # An ego that stands is of no class: waiting for it could go on for ever.
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
