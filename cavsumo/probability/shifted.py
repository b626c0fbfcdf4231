"""Learned shifts: normal numbers drawn around a mean that depends on the state, weighted exactly.

1. Play runs whose numbers are spread wider than by chance, so that some fail.
2. Fit m(x), linear in features of the state within each part of time, to the numbers of failing
   runs, weighted by their likelihood ratios (cross-entropy: Rubinstein 1999, Methodol. Comput.
   Appl. Probab. 1, 127; with proposals that depend on the state as by Delecki et al., arXiv
   2412.02154).
3. Play with numbers of mean m(x) and variance 1, weigh each run by its likelihood ratio

       p / q = 1 / sum over c of  share_c exp( sum over steps of  c m . n - c^2 m . m / 2 )

   and fit again; a mixture of c = 1, a smaller c and c = 0 bounds the weights.
4. Estimate from runs of their own, which learn nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cavsumo.probability.noisy import FAILED, RUNNING, NoisyProcess, SteppedEstimate
from cavsumo.probability.tree import Floats
from cavsumo.probability.weights import LEVEL, contradicts, weighted

EXPLORED, LEARNED, RUNS = 4000, (2000,) * 5, 20_000  # runs of each generation, of the estimate
KNOTS = 12  # parts of time, between which a shift is interpolated
WIDEST = 2.5  # standard deviation of exploration, at most
COMPONENTS = ((0.75, 1.0), (0.15, 0.6), (0.1, 0.0))  # share and c
RIDGE, MOST = 5.0, 2.0  # rows of no shift; the largest mean of a number
FEWEST_EFFECTIVE = (
    60.0  # effective failing runs to learn from; weights are levelled until there are
)


@dataclass(frozen=True, eq=False)
class Shift:
    """The mean of the numbers: a linear function, shape (columns, numbers)."""

    coefficients: Floats

    def mean(self, columns: Floats) -> Floats:
        """The mean at some rows of ``_columns``."""
        found: Floats = np.clip(columns @ self.coefficients, -MOST, MOST)
        return found


@dataclass(frozen=True, eq=False)
class ShiftedRuns:
    """Runs of a process.

    Attributes:
        terms: 1{failure} p / q of each run.
        logs: log p / q of the failing runs.
        columns, drawn: what the mean depends on and the numbers, of all steps of failing runs.
        owner: to which of the failing runs a row belongs.
        steps: of all runs.
    """

    terms: Floats
    logs: Floats
    columns: Floats
    drawn: Floats
    owner: np.ndarray
    steps: int


def estimate_by_shifts(
    process: NoisyProcess, rng: np.random.Generator, runs: int = RUNS, level: float = LEVEL
) -> SteppedEstimate:
    """The probability that a process fails; ``runs`` are those of the estimate.

    Refused where the weights are worth few failures or it contradicts its last pilot.
    """
    seen = [shifted_runs(process, None, EXPLORED, rng)]
    for count in (*LEARNED, runs):
        seen.append(shifted_runs(process, learned_shift(process, seen), count, rng))
    pilot, found = weighted(seen[-2].terms, 0.999), weighted(seen[-1].terms, level)
    found = replace(found, episodes=sum(len(one.terms) for one in seen))
    if not found.refused and not pilot.refused and contradicts(pilot, found):
        found = replace(found, refused="the estimate contradicts its pilot")
    return SteppedEstimate(found, sum(one.steps for one in seen))


def learned_shift(process: NoisyProcess, seen: list[ShiftedRuns]) -> Shift:
    """The mean that fits the failing runs of the last generations, by weighted ridge regression."""
    kept = [one for one in seen[-2:] if len(one.logs)]
    size = _columns(process, process.begin(1), 0).shape[1]
    if not kept:
        return Shift(np.zeros((size, process.numbers)))
    each = [_levelled(one.logs) for one in kept]
    weights = np.concatenate([w[one.owner] for w, one in zip(each, kept, strict=True)])
    columns = np.concatenate([one.columns for one in kept])
    drawn = np.concatenate([one.drawn for one in kept])
    weights *= len(weights) / weights.sum()
    left = columns.T @ (weights[:, None] * columns) + RIDGE * np.eye(size)
    return Shift(np.linalg.solve(left, columns.T @ (weights[:, None] * drawn)))


def shifted_runs(
    process: NoisyProcess, shift: Shift | None, count: int, rng: np.random.Generator
) -> ShiftedRuns:
    """Play runs with a shift; None: with numbers that are spread wider than by chance."""
    shares, factors = np.array(COMPONENTS).T
    own = np.searchsorted(np.cumsum(shares)[:-1], (np.arange(count) + 0.5) / count)
    spread = 1.0 + (WIDEST - 1.0) * rng.random(count) if shift is None else np.ones(count)
    states, logs = process.begin(count), np.zeros((len(shares), count))
    rows = list[tuple[np.ndarray, Floats, Floats]]()
    for step in range(process.horizon):
        go = np.flatnonzero(states[:, -1] == RUNNING)
        if not len(go):
            break
        columns = _columns(process, states[go], step)
        mean = np.zeros((len(go), process.numbers)) if shift is None else shift.mean(columns)
        drawn = spread[go, None] * rng.standard_normal(mean.shape)
        drawn += factors[own[go], None] * mean
        logs[:, go] += factors[:, None] * (mean * drawn).sum(1)
        logs[:, go] -= factors[:, None] ** 2 * (mean**2).sum(1) / 2
        if shift is None:  # every component is the density of the run's own spread
            logs[:, go] += 0.5 * (drawn**2).sum(1) * (1.0 - spread[go] ** -2)
            logs[:, go] -= process.numbers * np.log(spread[go])
        rows.append((go, columns, drawn))
        states[go] = process.moved(states[go], drawn)
    failed = states[:, -1] == FAILED
    ratio = -np.logaddexp.reduce(logs + np.log(shares)[:, None], axis=0)
    return _of_failing(failed, ratio, rows)


def _of_failing(
    failed: np.ndarray, ratio: Floats, rows: list[tuple[np.ndarray, Floats, Floats]]
) -> ShiftedRuns:
    """Some runs, with the steps of those that failed."""
    terms = np.where(failed, np.exp(np.where(failed, ratio, 0.0)), 0.0)
    number = np.cumsum(failed) - 1
    kept = [(number[go[failed[go]]], c[failed[go]], d[failed[go]]) for go, c, d in rows]
    owner, columns, drawn = (np.concatenate(parts) for parts in zip(*kept, strict=True))
    return ShiftedRuns(
        terms, ratio[failed], columns, drawn, owner, sum(len(go) for go, _, _ in rows)
    )


def _levelled(logs: Floats) -> Floats:
    """Weights of failing runs, to the largest power at which they are worth enough of them."""
    logs = logs - logs.max()
    wanted = min(FEWEST_EFFECTIVE, 0.5 * len(logs))
    for power in np.arange(1.0, 0.0, -0.05):
        weights: Floats = np.exp(power * logs)
        if weights.sum() ** 2 / (weights**2).sum() >= wanted:
            return weights
    return np.ones(len(logs))


def _columns(process: NoisyProcess, states: Floats, step: int) -> Floats:
    """One and the features, times how near the step is to each knot in time (0 to 1)."""
    near = np.maximum(0.0, 1.0 - np.abs(step / process.horizon * KNOTS - np.arange(KNOTS + 1)))
    single = np.hstack([np.ones((len(states), 1)), process.features(states)])
    found: Floats = (near[:, None] * single[:, None, :]).reshape(len(states), -1)
    return found
