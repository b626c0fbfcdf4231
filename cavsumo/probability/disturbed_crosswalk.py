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

PLACE, WALK, CAR = slice(0, 2), slice(2, 4), slice(4, 7)


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

    def features(self, states: Floats) -> Floats:
        """Places, speeds and errors of the estimate, scaled."""
        x, y, wx, wy, car, v, chosen, qx, qy, ux, _, _ = states.T
        scaled = [x, y / 3.0, wx, wy - 1.0, (car + 15.0) / 20.0, (v - 7.0) / 5.0]
        return np.stack([*scaled, chosen / 9.0, qx - x, qy - y, ux - wx], axis=1)
