"""Shifts: the mean and the deviation of the numbers of a step, learned from failing runs.

Where failing runs are draws of their own law, the normal proposal nearest to it (cross-entropy:
Rubinstein 1999, Methodol. Comput. Appl. Probab. 1, 127; with proposals that depend on the state as
by Delecki et al., arXiv 2412.02154) has the mean of their numbers, regressed on the state, and the
deviation of what remains. Two forms of the mean are fitted, as each is wrong elsewhere::

    in time      linear in the features, with coefficients that are interpolated over the time
    in squares   quadratic in the features, plus a function of the time
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cavsumo.probability.tree import Floats, Ints

IN_TIME, IN_SQUARES = "in time", "in squares"
KNOTS = 6  # parts of time, between which a mean is interpolated
PARTS = 24  # parts of time, between which a deviation is interpolated
LATE = 1 / 3  # of failing runs, to which a shift of their own is fitted
RIDGE, MOST = 10.0, 2.5  # rows of no shift; the largest mean of a number
NARROWEST, WIDEST = 0.6, 1.1  # deviations


@dataclass(frozen=True, eq=False)
class FailingRuns:
    """The steps of failing runs.

    Attributes:
        logs: log p / q of each run, up to a constant that they share.
        features: of the states, shape (rows, features).
        times: of the steps, from 0 to 1.
        drawn: the numbers, shape (rows, numbers).
        owner: to which of the runs a row belongs.
    """

    logs: Floats
    features: Floats
    times: Floats
    drawn: Floats
    owner: Ints

    @property
    def count(self) -> int:
        """The number of runs."""
        return len(self.logs)


@dataclass(frozen=True, eq=False)
class Shift:
    """A normal law of the numbers at each state.

    Attributes:
        form: of the mean.
        coefficients: shape (columns, numbers).
        variances: at the ends of the parts of time, shape (PARTS + 1, numbers).
    """

    form: str
    coefficients: Floats
    variances: Floats

    def mean(self, features: Floats, times: Floats) -> Floats:
        """The mean at some rows."""
        found: Floats = _columns(self.form, features, times) @ self.coefficients
        return np.clip(found, -MOST, MOST)

    def deviation(self, time: float) -> Floats:
        """The standard deviation of each number at a time."""
        found: Floats = np.sqrt(_near(np.array([time]), PARTS) @ self.variances)[0]
        return found


def joined(parts: Sequence[FailingRuns]) -> FailingRuns:
    """Failing runs of several proposals, as one set."""
    before = np.cumsum([0, *(one.count for one in parts)])
    return FailingRuns(
        logs=np.concatenate([one.logs for one in parts]),
        features=np.concatenate([one.features for one in parts]),
        times=np.concatenate([one.times for one in parts]),
        drawn=np.concatenate([one.drawn for one in parts]),
        owner=np.concatenate([one.owner + n for one, n in zip(parts, before, strict=False)]),
    )


def latest(runs: FailingRuns) -> FailingRuns:
    """The third of some failing runs that lasted longest; all of them if they last alike."""
    lasted = np.bincount(runs.owner, minlength=runs.count)
    late = lasted >= np.quantile(lasted, 1.0 - LATE)
    rows, number = late[runs.owner], np.cumsum(late) - 1
    return FailingRuns(
        logs=runs.logs[late],
        features=runs.features[rows],
        times=runs.times[rows],
        drawn=runs.drawn[rows],
        owner=number[runs.owner[rows]],
    )


def fitted(form: str, runs: FailingRuns, effective: float) -> Shift:
    """The shift of a form nearest to some failing runs, by weighted ridge regression.

    Args:
        form: of the mean.
        runs: at least one.
        effective: the weights are levelled until they are worth so many runs.
    """
    weights = levelled(runs.logs, effective)[runs.owner][:, None]
    weights *= len(weights) / weights.sum()
    columns, parts = _columns(form, runs.features, runs.times), _near(runs.times, PARTS)
    left = columns.T @ (weights * columns) + RIDGE * np.eye(columns.shape[1])
    right = columns.T @ (weights * runs.drawn)
    coefficients: Floats = np.linalg.solve(left, right).astype(np.float64)
    rest = runs.drawn - np.clip(columns @ coefficients, -MOST, MOST)
    spread = parts.T @ (weights * rest**2) + RIDGE
    found = spread / ((weights * parts).sum(0)[:, None] + RIDGE)
    variances: Floats = np.clip(found, NARROWEST**2, WIDEST**2)
    return Shift(form, coefficients, variances)


def levelled(logs: Floats, effective: float) -> Floats:
    """Weights of failing runs, to the largest power at which they are worth enough of them."""
    logs = logs - logs.max()
    wanted = min(effective, 0.5 * len(logs))
    for power in np.arange(1.0, 0.0, -0.05):
        weights: Floats = np.exp(power * logs)
        if weights.sum() ** 2 / (weights**2).sum() >= wanted:
            return weights
    return np.ones(len(logs))


def _columns(form: str, features: Floats, times: Floats) -> Floats:
    """The numbers in which the mean is linear, shape (rows, columns)."""
    near = _near(times, KNOTS)
    if form == IN_TIME:
        single = np.hstack([np.ones((len(features), 1)), features])
        found: Floats = (near[:, :, None] * single[:, None, :]).reshape(len(features), -1)
        return found
    first, second = np.triu_indices(features.shape[1])
    return np.hstack([near, features, features[:, first] * features[:, second]])


def _near(times: Floats, parts: int) -> Floats:
    """The nearness of each time to each end of so many parts, shape (rows, parts + 1)."""
    found: Floats = np.maximum(0.0, 1.0 - np.abs(times[:, None] * parts - np.arange(parts + 1)))
    return found
