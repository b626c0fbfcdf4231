"""An ego that a reference driver takes over in the middle of an episode."""

from __future__ import annotations

from cavsumo.agents.driving import Course
from cavsumo.egos.base import Acceleration, Command, Drive, Ego
from cavsumo.egos.reference.base import Reference
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot


class Takeover(Ego):
    """Drives as the original ego until a timestep, then as a reference driver that perceives there.

    The reference follows the ego's path and brakes. Until its brake takes effect it keeps the
    pedals as they are, but never gains speed: an ego that was braking continues to brake. The
    original is not called again.

    Args:
        ego: the original; it is not closed.
        drives: whether the original steers itself; the reference then also steers, by pure pursuit
            of the path, else SUMO steers.
    """

    def __init__(self, ego: Ego, *, drives: bool) -> None:
        self._ego, self._drives = ego, drives
        self._reference: Reference | None = None
        self._step = 0
        self.kind, self.depart_speed = ego.kind, ego.depart_speed
        self.sees_background = ego.sees_background

    def take_over(self, reference: Reference, step: int) -> None:
        """Have a reference driver decide from a timestep on, which has not been played yet."""
        self._reference, self._step = reference, step

    def vtype(self) -> dict[str, str]:
        return self._ego.vtype()

    def reset(self, scene: Scene) -> None:
        self._ego.reset(scene)
        self.begin(scene)

    def begin(self, scene: Scene) -> None:
        """Begin an episode for which the original has been reset."""
        self._dt = scene.dt
        self._course = Course(scene.ego_path, self.kind, scene.dt, self.kind.v_max)
        self._before: float | None = None  # speed at the timestep before
        self._kept = 0.0  # acceleration by the present pedals [m/s2]

    def act(self, snapshot: Snapshot) -> Command:
        v = snapshot.ego.v
        reference = self._reference
        if reference is None or snapshot.step < self._step:
            self._before = v
            return self._ego.act(snapshot)
        if snapshot.step == self._step and self._before is not None:
            self._kept = min(0.0, (v - self._before) / self._dt)
        elapsed = (snapshot.step - self._step) * self._dt
        braking = reference.throttle(elapsed, self._dt, self.kind)
        a = max(self.kind.throttle_min, min(self._kept, braking), -max(0.0, v) / self._dt)
        if self._drives:
            return Drive(a, self._course.steering(snapshot.ego))
        return Acceleration(a)
