"""A time-gap follower that brakes for bodies in its path: the example of a Python controller.

The Intelligent Driver Model (Treiber, Hennecke, Helbing, Phys. Rev. E 62, 2000, eq. 3)::

    a = a_max (1 - (v / v0)^4 - (s* / s)^2),   s* = s0 + v T + v dv / (2 sqrt(a_max b))

applied to the nearest body whose box reaches into the strip that the ego will sweep along its
path. It ignores traffic lights and rights of way.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import ClassVar

from cavsumo.egos.base import EGOS, Acceleration, Command, Ego
from cavsumo.model.checks import number
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

SIGHT_M = 80.0


@EGOS.register("time-gap")
class TimeGapEgo(Ego):
    """Keeps a time gap to bodies in its path and brakes for them (IDM), but ignores signals."""

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "speed": "desired speed v0 [m/s]; in a scripted test that of the test",
        "time_gap_s": "desired time gap T [s]",
        "standstill_m": "gap kept when standing, s0 [m]",
        "accel": "largest acceleration a_max [m/s2]",
        "decel": "comfortable deceleration b [m/s2]; in need it brakes with up to 9",
        "margin_m": "how far beside its own width it watches [m]",
    }

    def __init__(
        self,
        speed: float = 8.33,
        time_gap_s: float = 1.0,
        standstill_m: float = 2.0,
        accel: float = 1.5,
        decel: float = 3.0,
        margin_m: float = 0.3,
    ) -> None:
        self.speed = self.depart_speed = number("speed", speed, 0.1, self.kind.v_max)
        self.time_gap_s = number("time_gap_s", time_gap_s, 0.0, 10.0)
        self.standstill_m = number("standstill_m", standstill_m, 0.0, 20.0)
        self.accel = number("accel", accel, 0.01, self.kind.throttle_max)
        self.decel = number("decel", decel, 0.01, -self.kind.throttle_min)
        self.margin_m = number("margin_m", margin_m, 0.0, 10.0)

    def reset(self, scene: Scene) -> None:
        self.scene, self.path = scene, scene.ego_path
        self.desired = self.speed if scene.approach_speed is None else scene.approach_speed

    def act(self, snapshot: Snapshot) -> Command:
        v = snapshot.ego.v
        closest = min(self._obstacles(snapshot), default=(math.inf, 0.0))
        gap, speed = max(0.01, closest[0]), closest[1]
        approach = v * (v - speed) / (2.0 * math.sqrt(self.accel * self.decel))
        wanted = self.standstill_m + max(0.0, v * self.time_gap_s + approach)
        a = self.accel * (1.0 - (v / self.desired) ** 4 - (wanted / gap) ** 2)
        return Acceleration(min(self.accel, max(self.kind.throttle_min, a)))

    def _obstacles(self, snapshot: Snapshot) -> Iterator[tuple[float, float]]:
        """(gap, speed along the path) of each body ahead in the strip [m, m/s]."""
        ego = snapshot.ego
        front = self.scene.ego_progress(snapshot) + ego.body.kind.length / 2
        for body in (*snapshot.testers, *snapshot.background):
            if abs(body.x - ego.x) > SIGHT_M or abs(body.y - ego.y) > SIGHT_M:
                continue
            here = self.path.project(body.x, body.y)
            turn = body.o - self.path.at(here.along)[2]
            along, across = _extent(body, turn)
            room = abs(here.lateral) - across - ego.body.kind.width / 2
            gap = here.along - along - front
            if room <= self.margin_m and gap > -ego.body.kind.length / 2:
                yield gap, body.v * math.cos(turn)


def _extent(body: BodyState, turn: float) -> tuple[float, float]:
    """Half the length that a turned box takes along the path and across it [m]."""
    kind, c, s = body.body.kind, abs(math.cos(turn)), abs(math.sin(turn))
    return (kind.length * c + kind.width * s) / 2, (kind.length * s + kind.width * c) / 2
