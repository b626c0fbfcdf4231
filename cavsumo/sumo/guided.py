"""The ego of a scripted test in SUMO: it enters with its test speed, and follows the given way.

SUMO or the ego's controller decides how fast it drives, and SUMO counts the distance that it has
driven; where it is follows from that, on the way of the script. SUMO's own lanes are its guide to
leaders and traffic rules only. Until shortly before the test (``begins_m``) the ego is held at the
speed of the test: SUMO's driver dawdles, and a controller may give way to a vehicle ahead from the
moment at which it enters. An ego that steers itself is not held.
"""

from __future__ import annotations

import math
from typing import Any

from cavsumo.model.bodies import Body
from cavsumo.model.scenario.script import ScriptedTest
from cavsumo.model.snapshot import BodyState

ALL_CHECKS = 31  # setSpeedMode: SUMO's driver decides, within all of its limits
UNSAFE = 0
KEEP_LANE = 0  # setLaneChangeMode: it changes lanes for no reason


class GuidedEgo:
    """The ego of one episode.

    Args:
        sumo: SUMO's functions.
        script: with the way and the speed.
        body: of the ego; its id is that in SUMO.
    """

    def __init__(self, sumo: Any, script: ScriptedTest, body: Body) -> None:
        self._sumo, self._script, self._body = sumo, script, body
        self._axle = script.ego.axle(body.kind.length)
        self._curve = script.ego.way.curve
        self._held, self._kept, self._before = True, True, 0.0

    def enter(self) -> None:
        """Give the ego, which stands on its lane, the speed of the test in the next timestep."""
        vehicle, name, speed = self._sumo.vehicle, self._body.id, self._script.ego.speed_mps
        for lane in self._sumo.lane.getIDList():
            self._sumo.lane.setMaxSpeed(lane, speed)
        vehicle.setSpeedFactor(name, 1.0)
        vehicle.setLaneChangeMode(name, KEEP_LANE)
        vehicle.setSpeedMode(name, UNSAFE)
        vehicle.setSpeed(name, speed)

    def begin(self) -> BodyState:
        """Count the distance from here; returns where the ego is."""
        self._before = float(self._sumo.vehicle.getDistance(self._body.id))
        return self.state()

    def held(self) -> bool:
        """Whether it still keeps the speed of the test instead of obeying its controller."""
        self._held = self._held and self._front() < self._script.begins_m
        return self._held

    def release(self) -> None:
        """Leave the speed to SUMO's driver once it is near enough."""
        if self._kept and not self.held():
            self._kept = False
            self._sumo.vehicle.setSpeedMode(self._body.id, ALL_CHECKS)
            self._sumo.vehicle.setSpeed(self._body.id, -1.0)

    def state(self) -> BodyState:
        """Where the ego is."""
        x, y, o = self._curve.at(self._front() - self._axle)
        forward = self._axle - self._body.kind.length / 2
        speed = self._sumo.vehicle.getSpeed(self._body.id)
        return BodyState(self._body, x + forward * math.cos(o), y + forward * math.sin(o), speed, o)

    def _front(self) -> float:
        """Arc length of its front on the way [m]."""
        driven = float(self._sumo.vehicle.getDistance(self._body.id)) - self._before
        return self._script.ego.start_m + driven
