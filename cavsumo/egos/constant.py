"""An ego that always keeps its speed, as in CAV-Gym's experiments."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from cavsumo.egos.base import EGOS, Acceleration, Command, Ego
from cavsumo.model.checks import number
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot


@EGOS.register("constant")
class ConstantEgo(Ego):
    """Keeps its speed and its route and never brakes (CAV-Gym's ego)."""

    sees_background = False

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "speed": "the speed it keeps [m/s]; in a scripted test that of the test"
    }

    def __init__(self, speed: float = 6.75) -> None:
        self.speed = number("speed", speed, 0.0, self.kind.v_max)
        self.depart_speed = self.speed

    def reset(self, scene: Scene) -> None:
        self.dt = scene.dt
        self.kept = self.speed if scene.approach_speed is None else scene.approach_speed

    def act(self, snapshot: Snapshot) -> Command:
        # SUMO may still correct the speed on insertion; full throttle or brake brings it back.
        wanted = (self.kept - snapshot.ego.v) / self.dt
        return Acceleration(min(self.kind.throttle_max, max(self.kind.throttle_min, wanted)))
