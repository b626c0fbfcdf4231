"""The crosswalk of adaptive stress testing (``cavsumo.model.crosswalk``), step by step.

A run fails with the same normal numbers as there; here it can be continued from any state.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cavsumo.model import crosswalk
from cavsumo.model.crosswalk import CrosswalkStart
from cavsumo.probability.noisy import FAILED, RUNNING
from cavsumo.probability.tree import Floats

PLACE, WALK, CAR, SEEN = slice(0, 2), slice(2, 4), slice(4, 7), slice(7, 11)


@dataclass(frozen=True)
class DisturbedCrosswalk:
    """The process from a starting point.

    A state is the pedestrian's place and velocity; the car's place, speed and chosen acceleration;
    the estimated place and velocity; and whether the run goes on.
    """

    start: CrosswalkStart
    horizon: int = crosswalk.STEPS
    numbers: int = len(crosswalk.DEVIATIONS)

    def begin(self, count: int) -> Floats:
        """First states."""
        here, walk = [self.start.x_m, self.start.y_m], [0.0, self.start.walk_mps]
        car = [self.start.car_m, self.start.car_mps, 0.0]
        return np.tile(np.array([*here, *walk, *car, *here, *walk, RUNNING]), (count, 1))

    def moved(self, states: Floats, drawn: Floats) -> Floats:
        """The states after a step."""
        scaled = drawn * np.array(crosswalk.DEVIATIONS)
        x, v, chosen = states[:, CAR].T
        x, v = x + crosswalk.DT_S * v, v + crosswalk.DT_S * chosen
        place, velocity = crosswalk.pushed(states[:, PLACE], states[:, WALK], scaled[:, :2])
        seen = crosswalk.filtered(states[:, 7:9], states[:, 9:11], place + scaled[:, 2:])
        chosen = crosswalk.chosen_acceleration(v, seen[0][:, 0] - x, seen[0][:, 1], seen[1][:, 0])
        failed = crosswalk.struck(place, x, v)
        car = np.stack([x, v, chosen], axis=1)
        last = np.where(failed, FAILED, RUNNING)[:, None]
        return np.concatenate([place, velocity, car, *seen, last], axis=1)

    def score(self, states: Floats) -> Floats:
        """The braking that the car would need, less what keeps both from meeting."""
        (x, y), walk, (car, v, _) = states[:, PLACE].T, states[:, 3], states[:, CAR].T
        zone, aside = crosswalk.ZONE_M
        ahead = x - zone - car
        needed = v * v / (2.0 * np.maximum(0.5, ahead))
        until = np.maximum(0.0, np.abs(y) - aside) / np.maximum(0.3, walk)
        late = np.abs(until - np.maximum(0.0, ahead) / np.maximum(v, 0.5))
        passed = np.where(ahead < -2.0 * zone, 10.0, 0.0)
        return np.where(states[:, -1] == FAILED, 100.0, needed - 2.0 * late - passed)

    def features(self, states: Floats) -> Floats:
        """Places, speeds and errors of the estimate, scaled."""
        x, y, wx, wy, car, v, chosen, qx, qy, ux, _, _ = states.T
        scaled = [x, y / 3.0, wx, wy - 1.0, (car + 15.0) / 20.0, (v - 7.0) / 5.0]
        return np.stack([*scaled, chosen / 9.0, qx - x, qy - y, ux - wx], axis=1)
