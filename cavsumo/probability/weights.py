"""Estimates from weighted episodes, and the checks without which they are not printed.

With draws U of a proposal q instead of p, the mean of  X = 1{failure} p(U) / q(U)  is the
probability. Its standard error says nothing about failures that the proposal all but never draws.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cavsumo.probability.tree import Floats

LEVEL = 0.95
FEWEST_EFFECTIVE = 20.0  # fewer effective failures carry no normal interval
LARGEST_SHARE = 0.2  # of the sum in one episode


@dataclass(frozen=True)
class Estimate:
    """A probability with its interval, or the reason why none is given.

    Attributes:
        p: the estimate.
        lower, upper: the interval.
        level: its nominal coverage.
        episodes: how many it rests on, pilots included.
        failures: failures among them.
        effective: effective number of failures, (sum w)^2 / sum w^2.
        largest: the share of the largest weight in the sum.
        refused: why it is not a result; empty for a result.
    """

    p: float
    lower: float
    upper: float
    level: float
    episodes: int
    failures: int
    effective: float
    largest: float
    refused: str = ""

    @property
    def relative(self) -> float:
        """Half of the interval over the estimate; infinite where that is 0."""
        return (self.upper - self.lower) / 2 / self.p if self.p > 0.0 else math.inf


def normal_interval(mean: float, error: float, degrees: int, level: float) -> tuple[float, float]:
    """A t interval of a probability with a standard error."""
    from scipy.special import stdtrit

    half = float(stdtrit(degrees, 0.5 + level / 2)) * error
    return max(0.0, mean - half), min(1.0, mean + half)


def weighted(terms: Floats, level: float = LEVEL) -> Estimate:
    """The estimate from the terms 1{failure} w of independent episodes, at least two."""
    n, total = len(terms), float(terms.sum())
    mean, error = total / n, float(terms.std(ddof=1)) / math.sqrt(n)
    lower, upper = normal_interval(mean, error, n - 1, level)
    failures = int(np.count_nonzero(terms))
    squares = float((terms**2).sum())
    effective = total**2 / squares if squares > 0.0 else 0.0
    largest = float(terms.max()) / total if total > 0.0 else 1.0
    refused = _refusal(failures, effective, largest)
    return Estimate(mean, lower, upper, level, n, failures, effective, largest, refused)


def _refusal(failures: int, effective: float, largest: float) -> str:
    """Why weighted episodes give no interval, if they do not."""
    if failures == 0:
        return "no failure was drawn"
    if largest > LARGEST_SHARE:
        return f"one episode carries {largest:.0%} of the sum"
    if effective < FEWEST_EFFECTIVE:
        return f"the weights are worth only {effective:.1f} failures"
    return ""


def contradicts(one: Estimate, other: Estimate) -> bool:
    """Whether two intervals of the same probability have no point in common."""
    return one.lower > other.upper or other.lower > one.upper


def gain_of(terms: Floats, share: float) -> tuple[float, float, float]:
    """p (1 - p) over the variance of the terms, times their share of all episodes, and an interval.

    The interval is that of 400 resamples of the terms (Efron 1979, Ann. Stat. 7, 1), from a seed of
    its own.
    """
    rng, n = np.random.default_rng(0), len(terms)
    mean, variance = float(terms.mean()), float(terms.var())
    if variance == 0.0:
        return math.nan, 0.0, math.inf
    drawn = terms[rng.integers(n, size=(400, n))]
    means, spread = drawn.mean(1), drawn.var(1)
    kept = spread > 0.0
    gains = share * means[kept] * (1.0 - means[kept]) / spread[kept]
    low, high = quantiles(gains)
    return share * mean * (1.0 - mean) / variance, low, high


def quantiles(resampled: Floats) -> tuple[float, float]:
    """The interval of 95 % that resamples give."""
    low, high = (float(one) for one in np.quantile(resampled, [0.025, 0.975]))
    return low, high
