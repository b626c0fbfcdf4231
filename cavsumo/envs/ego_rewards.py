"""The reward of a learning ego: progress along its path, less costs.

In one timestep of dt seconds, with p metres of progress along the path and acceleration a::

    PROGRESS p - TIME_COST dt - HARSH_COST a^2 dt

and once VIOLATION less when it breaks an assertion, OFF_ROAD less when its centre leaves the
carriageway. A test that was unfair costs nothing: no ego could have stopped.
"""

from __future__ import annotations

from collections.abc import Sequence

from cavsumo.assertions.base import VIOLATED, Judgement
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

PROGRESS = 1.0  # per metre along the path
TIME_COST = 1.0  # per second
HARSH_COST = 0.05  # per second and (m/s2)^2: full braking at 9 m/s2 costs 4 a second
VIOLATION = 100.0
OFF_ROAD = 100.0


class EgoRewardMonitor:
    """The rewards of one episode.

    Attributes:
        off_road: whether the ego's centre has left the carriageway.
    """

    def __init__(self, scene: Scene, snapshot: Snapshot, *, steers: bool) -> None:
        """``steers``: the ego steers itself, so it may leave the carriageway."""
        self._scene, self._steers, self._before = scene, steers, snapshot
        self._along = scene.ego_progress(snapshot)
        self._violated = self.off_road = False

    def reward(self, successor: Snapshot | None, judgements: Sequence[Judgement]) -> float:
        """The reward for a timestep; ``successor`` is None when the ego left the network."""
        dt = self._scene.dt
        reward = -TIME_COST * dt
        if successor is None:
            return reward
        along = self._scene.ego_progress(successor)
        acceleration = (successor.ego.v - self._before.ego.v) / dt
        reward += PROGRESS * (along - self._along) - HARSH_COST * acceleration**2 * dt
        self._along, self._before = along, successor
        if not self._violated and any(j.verdict == VIOLATED for j in judgements):
            self._violated = True
            reward -= VIOLATION
        roads = self._scene.roads
        if self._steers and roads and not roads.contains(successor.ego.x, successor.ego.y):
            self.off_road = True
            reward -= OFF_ROAD
        return reward
