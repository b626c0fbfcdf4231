"""Processes that are disturbed by standard normal numbers in every step, and runs of them.

An episode is a function of ``horizon`` by ``numbers`` independent standard normal numbers, hundreds
in all, so no proposal for the whole vector is learned. Estimators work step by step: they branch
(``splitting``) or shift the numbers by the state (``shifted``).
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from cavsumo.probability.tree import Floats
from cavsumo.probability.weights import Estimate

RUNNING, FAILED, ENDED = 0.0, 1.0, 2.0  # the last column of a state
AT_ONCE = 20_000  # runs, so that the memory is bounded
WIDEST = 2.5  # standard deviation of the numbers of exploring runs, at most

Visited = list[Floats]  # the running states of runs at each step


class NoisyProcess(Protocol):
    """A process whose state is a row of numbers; many runs are moved together.

    Attributes:
        horizon: the most steps of a run.
        numbers: standard normal numbers a step.
    """

    @property
    def horizon(self) -> int: ...
    @property
    def numbers(self) -> int: ...

    def begin(self, count: int) -> Floats:
        """First states of so many runs, shape (count, columns); the last column is RUNNING."""

    def moved(self, states: Floats, drawn: Floats) -> Floats:
        """The states after a step, for running states and numbers of shape (n, numbers)."""

    def features(self, states: Floats) -> Floats:
        """The numbers that a proposal may depend on, about in [-1, 1], shape (n, features)."""


class SteppedEstimate(NamedTuple):
    """An estimate and the steps that it took, those of learning included."""

    estimate: Estimate
    steps: int


class ChanceRuns(NamedTuple):
    """Runs by chance: how many, how many failed, and their steps."""

    runs: int
    failures: int
    steps: int


def exploring_spread(count: int, rng: np.random.Generator) -> Floats:
    """The standard deviation of the numbers of each of so many exploring runs."""
    return rng.uniform(1.0, WIDEST, count)


def counted(process: NoisyProcess, count: int, rng: np.random.Generator) -> ChanceRuns:
    """Play runs by chance, as plain Monte Carlo does."""
    failures = steps = 0
    for done in range(0, count, AT_ONCE):
        states = process.begin(min(AT_ONCE, count - done))
        for _ in range(process.horizon):
            steps += len(states)
            states = process.moved(states, rng.standard_normal((len(states), process.numbers)))
            failures += int((states[:, -1] == FAILED).sum())
            states = states[states[:, -1] == RUNNING]
            if not len(states):
                break
    return ChanceRuns(count, failures, steps)
