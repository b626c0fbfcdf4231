"""The chance to fail from each state of a process, learned backwards from the last step.

The chance at step t is the mean of that after one more step, with 1 where a run has failed and 0
where it has ended::

    V(t, s) = E[V(t + 1, s')]

At each step some states that runs have visited are moved several times by chance, and the mean of V
after that is regressed on the features of the state: log V is a polynomial (all products of two,
and cubes), fitted with a logarithmic link as a generalized linear model (McCullagh and Nelder 1989,
chapter 8). Relative errors count alike, except where a chance is much smaller than the mean.

What is wrong with it costs an estimate that is built on it precision, not correctness.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cavsumo.probability.noisy import FAILED, RUNNING, NoisyProcess, Visited, exploring_spread
from cavsumo.probability.tree import Floats

FLOOR, CEILING = -20.0, -1e-3  # of log V while a run goes on
FEWEST, MOST, BRANCHES = 100, 1500, 8  # states of a fit, and how often each is moved
RIDGE, PASSES, MOST_UP = 0.001, 15, 10.0  # of the regression; the most that log V rises in a pass
LITTLE = 0.01  # of the mean chance, below which a chance is known badly
FARTHEST = 3.0  # standard deviations of the fitted states, beyond which a feature counts no more


class StepFit(NamedTuple):
    """log V at one step, as a polynomial of features in these units.

    Attributes:
        centre, unit: of the features.
        coefficients: shape (columns,).
    """

    centre: Floats
    unit: Floats
    coefficients: Floats

    def log(self, features: Floats) -> Floats:
        """log V, within its bounds."""
        found: Floats = _columns((features - self.centre) / self.unit) @ self.coefficients
        return np.clip(found, FLOOR, CEILING)


@dataclass(frozen=True, eq=False)
class FailureChances:
    """The chance to fail, from each state.

    Attributes:
        process: whose states are meant.
        fits: one for each number of steps; None where too few states were visited.
    """

    process: NoisyProcess
    fits: tuple[StepFit | None, ...]

    def log(self, states: Floats, step: int) -> Floats:
        """The logarithm of the chance at so many steps, shape (n,); 0 for what has failed."""
        return _logs(self.process, self.fits[step], states)


class LearnedChances(NamedTuple):
    """Failure chances and the steps that it took to learn them."""

    chances: FailureChances
    steps: int


def learned_chances(
    process: NoisyProcess, visited: Visited, rng: np.random.Generator
) -> LearnedChances:
    """Fit the chances at the states that runs have visited, from the last step to the first."""
    fits: list[StepFit | None] = [None] * (process.horizon + 1)
    steps = 0
    for step in reversed(range(process.horizon)):
        states = visited[step]
        if len(states) < FEWEST:
            continue
        if len(states) > MOST:
            states = states[rng.choice(len(states), MOST, replace=False)]
        again = np.repeat(states, BRANCHES, axis=0)
        after = process.moved(again, rng.standard_normal((len(again), process.numbers)))
        chances = np.exp(_logs(process, fits[step + 1], after)).reshape(-1, BRANCHES).mean(1)
        fits[step] = _fitted(process.features(states), chances)
        steps += len(again)
    return LearnedChances(FailureChances(process, tuple(fits)), steps)


def explored_states(process: NoisyProcess, count: int, rng: np.random.Generator) -> Visited:
    """The states of runs whose numbers are spread wider, each run's by a factor of its own."""
    spread = exploring_spread(count, rng)
    states, visited = process.begin(count), Visited()
    for _ in range(process.horizon):
        go = np.flatnonzero(states[:, -1] == RUNNING)
        visited.append(states[go])
        drawn = spread[go, None] * rng.standard_normal((len(go), process.numbers))
        states[go] = process.moved(states[go], drawn)
    return visited


def joined_states(parts: Sequence[Visited]) -> Visited:
    """The states that several sets of runs have visited at each step."""
    return [np.concatenate(step) for step in zip(*parts, strict=True)]


def _logs(process: NoisyProcess, fit: StepFit | None, states: Floats) -> Floats:
    """log V of states at one step."""
    found = np.where(states[:, -1] == FAILED, 0.0, FLOOR)
    go = np.flatnonzero(states[:, -1] == RUNNING)
    if fit is not None and len(go):
        found[go] = fit.log(process.features(states[go]))
    return found


def _fitted(features: Floats, chances: Floats) -> StepFit:
    """Regression with a logarithmic link and weights of relative errors.

    A chance much smaller than the mean is a mean of few branches that fail, if any, so its weight
    falls; the first values are those of least squares, where no chance is 0.
    """
    centre, unit = features.mean(0), features.std(0) + 1e-6
    columns = _columns((features - centre) / unit)
    penalty = RIDGE * len(columns) * np.eye(columns.shape[1])
    penalty[0, 0] = 0.0
    small = LITTLE * float(chances.mean()) + np.exp(FLOOR)
    wanted, weights = np.log(chances + small), np.ones(len(columns))
    for _ in range(1 + PASSES):
        weighted = weights[:, None] * columns
        left = columns.T @ weighted + weights.mean() * penalty
        coefficients: Floats = np.linalg.solve(left, weighted.T @ wanted)
        logs = np.clip(columns @ coefficients, FLOOR, 0.0)
        wanted = logs + np.clip(chances / np.exp(logs) - 1.0, -1.0, MOST_UP)
        weights = 1.0 / (1.0 + small / np.exp(logs))
    return StepFit(centre, unit, coefficients)


def _columns(features: Floats) -> Floats:
    """1, the features, their products of two and their cubes, shape (rows, columns)."""
    x = np.clip(features, -FARTHEST, FARTHEST)
    first, second = np.triu_indices(x.shape[1])
    return np.hstack([np.ones((len(x), 1)), x, x[:, first] * x[:, second], x**3])
