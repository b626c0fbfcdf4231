"""A follower behind a disturbed leader: a small process whose failure probability is known exactly.

For checking estimators. The state is the gap g (cells of 1 m, at most 60) and the speeds ve of the
ego and vl of its leader (0 to 10); a step takes one second::

    vl' = clip(vl + a_l, 0, 10)        a_l: -3 with p3, -1 with 0.10, +1 with 0.12, else 0
    d = standstill + ve + closing max(0, ve - vl)
    ve' = clip(ve + a_e, 0, 10)        a_e: +1 if g > d + slack, -hard if g < d - near,
                                            -1 if g < d, else 0
    g' = min(60, g + vl' - ve'),       failed if g' <= 0

The ego reacts to the leader's old speed, one step late.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cavsumo.probability.tree import Floats, Ints

GAPS, SPEEDS = 60, 11
FAILED = GAPS * SPEEDS * SPEEDS  # the number of the state after a failure
CHANGES = np.array([-3, -1, 0, 1])  # of the leader's speed


@dataclass(frozen=True)
class Following:
    """The process: its chance, its ego and where it begins.

    Attributes:
        p3: probability that the leader brakes by 3 in a step.
        standstill, closing, slack, near, hard: of the ego, see above.
        gap, ego, leader: the first state.
        horizon: number of steps.
    """

    p3: float = 0.003
    standstill: int = 2
    closing: int = 2
    slack: int = 2
    near: int = 4
    hard: int = 2
    gap: int = 12
    ego: int = 8
    leader: int = 8
    horizon: int = 60

    @property
    def chances(self) -> Floats:
        """The probability of each disturbance."""
        return np.array([self.p3, 0.10, 1.0 - self.p3 - 0.10 - 0.12, 0.12])

    @property
    def states(self) -> int:
        """The number of states; the last one is that of a failure."""
        return FAILED + 1

    @property
    def first(self) -> int:
        """The number of the first state."""
        return ((self.gap - 1) * SPEEDS + self.ego) * SPEEDS + self.leader

    def features(self, states: Ints) -> Floats:
        """Features for a model of the ego: gap, both speeds, closing speed, gap less a step."""
        g, ve, vl = _parts(states)
        return np.stack([g, ve, vl, ve - vl, g - ve], axis=1).astype(float)

    def respond(self, states: Ints, rng: np.random.Generator) -> Ints:
        """The ego's change of speed in some states: the black box."""
        g, ve, vl = _parts(states)
        wanted = self.standstill + ve + self.closing * np.maximum(0, ve - vl)
        braking = np.where(g < wanted - self.near, -self.hard, np.where(g < wanted, -1, 0))
        return np.where(g > wanted + self.slack, 1, braking)

    def moved(self, states: Ints, disturbance: Ints, response: Ints) -> Ints:
        """The next states, after the disturbances (by number) and the ego's responses."""
        g, ve, vl = _parts(states)
        vl = np.clip(vl + CHANGES[disturbance], 0, SPEEDS - 1)
        ve = np.clip(ve + response, 0, SPEEDS - 1)
        g = np.minimum(GAPS, g + vl - ve)
        there = ((g - 1) * SPEEDS + ve) * SPEEDS + vl
        return np.where((states == FAILED) | (g <= 0), FAILED, there)


def exact_probability(process: Following) -> float:
    """The probability of a failure within the horizon, by forward dynamic programming."""
    states = np.arange(process.states)
    response = process.respond(states, np.random.default_rng(0))
    mass = np.zeros(process.states)
    mass[process.first] = 1.0
    ways = [process.moved(states, np.full(len(states), k), response) for k in range(len(CHANGES))]
    for _ in range(process.horizon):
        shares = [
            np.bincount(way, chance * mass, process.states)
            for way, chance in zip(ways, process.chances, strict=True)
        ]
        mass = np.sum(shares, axis=0)
    return float(mass[FAILED])


def _parts(states: Ints) -> tuple[Ints, Ints, Ints]:
    """Gap and both speeds of some states."""
    return states // SPEEDS**2 + 1, states // SPEEDS % SPEEDS, states % SPEEDS
