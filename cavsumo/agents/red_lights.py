"""Red lights on the ego's way, for those who are to meet it or to drive in its lane."""

from __future__ import annotations

import math

from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

STOP = "ruyY"  # SUMO's letters: red, red and amber, amber
COMFORT_MPS2 = 4.5  # one that could not stop with this drives on


def red_along(scene: Scene, snapshot: Snapshot, beyond: float) -> float:
    """Arc length on the ego's path of the first stop line at red or amber beyond a place [m].

    Infinite if there is none.
    """
    for light, shown in zip(scene.lights, snapshot.lights, strict=False):
        if light.along >= beyond and shown in STOP:
            return light.along
    return math.inf


def holds(line: float, front: float, v: float) -> bool:
    """Whether somebody at a speed [m/s] can still stop before a line in comfort."""
    return line - front >= v * v / (2.0 * COMFORT_MPS2)
