"""The best response to a counted ego: a Markov decision process on a grid, solved as a game.

Player 2 has one action (or, for a robust plan, may bend the counts within their confidence). In
each timestep the ego keeps its acceleration or chooses anew, by the counts.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from cavsumo.agents.planning.grid import CLASSES, Floats, Grid, Ints, States, corners
from cavsumo.agents.planning.moves import Aim, move
from cavsumo.agents.planning.opponent import ENTRY_S, NEED_MPS2, SPEED_MPS, Counts, Key

CERTAIN_NOT = 0.01  # a hazard below this is none
NEGLIGIBLE = 1e-3  # branches less likely than this are left out
PRECISION = 1e-2


class Counted(NamedTuple):
    """The counts as arrays.

    Attributes:
        hazard: [aware, age] probability that the ego decides.
        chances: [entry cell, need cell, speed cell, class] least probability of each class then;
            the rest of 1 lies on the class that is worst for the tester.
        middles: [class] accelerations [m/s2].
    """

    hazard: Floats
    chances: Floats
    middles: Floats


def counted(counts: Counts, grid: Grid, confidence: float | None) -> Counted:
    """The counts as arrays for a grid, with sets around them if a confidence is given."""
    if confidence is None:
        chances = tabulated(counts.chances)
        chances[chances < NEGLIGIBLE] = 0.0
        chances /= chances.sum(axis=-1, keepdims=True)
    else:
        chances = tabulated(functools.partial(counts.floor, confidence=confidence))
    hazard = np.array([[counts.hazard(k, held) for held in range(grid.ages)] for k in (0, 1)])
    hazard[hazard < CERTAIN_NOT] = 0.0
    middles = [counts.middle(which) for which in range(CLASSES)]
    return Counted(hazard, chances, np.array(middles))


def tabulated(of: Callable[[Key], list[float]]) -> Floats:
    """A number for each class in every situation, shape (entry, need, speed, class)."""
    table = np.empty((len(ENTRY_S) + 1, len(NEED_MPS2) + 1, len(SPEED_MPS) + 1, CLASSES))
    for i, j, k in np.ndindex(*table.shape[:3]):
        table[i, j, k] = of((i, j, k))
    return table


def situations(states: States, dt: float) -> tuple[Ints, Ints, Ints]:
    """The cells of ``opponent.situation``, for arrays."""
    gap = states.gap
    need = np.where(gap > 0.05, states.v**2 / (2.0 * np.maximum(gap, 0.05)), NEED_MPS2[-1] + 1.0)
    return (
        np.searchsorted(ENTRY_S, states.entry * dt, side="right"),
        np.searchsorted(NEED_MPS2, need, side="right"),
        np.searchsorted(SPEED_MPS, states.v, side="right"),
    )


def deciding(states: States, model: Counted, dt: float) -> tuple[Floats, Floats]:
    """Probability that the ego decides, shape (n,), and those of the classes then, (n, classes)."""
    cells = situations(states, dt)
    near = (cells[0] < len(ENTRY_S)).astype(int)
    held = np.minimum(states.held, model.hazard.shape[1] - 1)
    return model.hazard[near, held], model.chances[cells]


class Backup(NamedTuple):
    """The values of some moves, by the decision of the ego.

    Attributes:
        decides: probability that it chooses anew, shape (n,).
        chances: [n, class] least probability of each; the rest of 1 lies on the worst class.
        keeps: worth if it keeps its acceleration, shape (n,).
        takes: [n, class] worth if it takes one.
    """

    decides: Floats
    chances: Floats
    keeps: Floats
    takes: Floats

    @property
    def worth(self) -> Floats:
        """The expected value, in the worst case that the counts permit."""
        rest = 1.0 - self.chances.sum(axis=1)
        takes = (self.chances * self.takes).sum(axis=1) + rest * self.takes.min(axis=1)
        worth: Floats = (1.0 - self.decides) * self.keeps + self.decides * takes
        return worth


@dataclass(frozen=True)
class Plan:
    """A best response, solved or being solved.

    Attributes:
        grid, aim, model: of the decision process.
        value: of each state, minus the expected price, flat.
    """

    grid: Grid
    aim: Aim
    model: Counted
    value: Floats = field(repr=False)

    def back_up(self, states: States, action: Ints, a: Floats, which: Ints) -> Backup:
        """One timestep from some states, then the values.

        Args:
            action: STAND or WALK for each.
            a: the ego's acceleration in the last timestep [m/s2]; ``which``: its class.
        """
        decides, chances = deciding(states, self.model, self.grid.dt)
        keeps = self._later(states, action, a, states.held + 1, which)
        anew, takes = np.zeros_like(states.held), np.zeros((len(action), CLASSES))
        if (decides > 0.0).any():
            for k, middle in enumerate(self.model.middles):
                taken = np.full(len(action), middle)
                takes[:, k] = self._later(states, action, taken, anew, np.full(len(action), k))
        return Backup(decides, chances, keeps, takes)

    def _later(self, states: States, action: Ints, a: Floats, held: Ints, which: Ints) -> Floats:
        moved = move(states, action, a, held, self.grid, self.aim)
        places, weights = corners(moved.states, which, self.grid)
        later = (self.value[places] * weights).sum(axis=0)
        worth: Floats = (1.0 - moved.over) * later - moved.price
        return worth
