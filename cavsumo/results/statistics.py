"""Rates with intervals."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Rate:
    """A share with a 95 % interval.

    Attributes:
        count, total: successes among trials.
        value: count / total, None when there were no trials.
        low, high: the interval, None when there were no trials.
    """

    count: int
    total: int
    value: float | None
    low: float | None
    high: float | None

    def overlaps(self, low: float, high: float) -> bool:
        """Whether the interval and another one have a point in common."""
        if self.low is None or self.high is None:
            return False
        return self.low <= high and low <= self.high


def rate(count: int, total: int, method: Literal["wilson", "exact"] = "wilson") -> Rate:
    """The share of count among total, with a 95 % interval for a number of trials fixed before.

    Args:
        method: "wilson" (Wilson 1927: right on average) or "exact" (Clopper and Pearson 1934:
            contains the share at least as often), both by scipy.
    """
    if total == 0:
        return Rate(count, total, None, None, None)
    from scipy.stats import binomtest

    interval = binomtest(count, total).proportion_ci(0.95, method=method)
    return Rate(count, total, count / total, float(interval.low), float(interval.high))


def lower_bound(count: int, total: int, confidence: float) -> float:
    """The probability p below which so many successes are less likely than 1 - confidence.

    One-sided, by Clopper and Pearson (1934, Biometrika 26, 404)::

        P(X >= count | p) = 1 - confidence,   X ~ Bin(total, p);   0 for count = 0

    With a number of trials fixed before, the bound is above the true probability with probability
    at most 1 - confidence, for every such probability.
    """
    if count == 0:
        return 0.0
    from scipy.special import betaincinv

    return float(betaincinv(count, total - count + 1, 1.0 - confidence))


def sequential_rate(count: int, total: int, level: float = 0.95) -> Rate:
    """The share of count among total, with an interval that is valid at any stopping time.

    The beta-binomial confidence sequence (Robbins 1970, Ann. Math. Stat. 41, 1397; Howard et al.
    2021, Ann. Stat. 49, 1055): with independent trials of probability p the ratio of the mixed
    likelihood, over a Beta(1/2, 1/2) prior, to that of p is a martingale, and exceeds 20 at any
    time with probability at most 5 % (Ville; 1 / (1 - level) for other levels). The interval holds
    the p where it does not.
    """
    if total == 0:
        return Rate(count, total, None, None, None)
    from scipy.optimize import brentq

    def excess(p: float) -> float:
        return _evidence(count, total, p) + math.log1p(-level)

    share, edge = count / total, 1e-12
    low = float(brentq(excess, edge, share)) if count and excess(edge) > 0 else 0.0
    high = float(brentq(excess, share, 1 - edge)) if count < total and excess(1 - edge) > 0 else 1.0
    return Rate(count, total, share, low, high)


def sequential_p(count: int, total: int, p: float = 0.5) -> float:
    """The p-value of the hypothesis that the probability is p, valid at any stopping time.

    One over the same martingale (Ville): small at any time with at most that probability.
    """
    return min(1.0, math.exp(-_evidence(count, total, p)))


def _evidence(count: int, total: int, p: float) -> float:
    """The logarithm of the mixed likelihood over that of p."""
    from scipy.special import betaln, xlog1py, xlogy

    mixed = betaln(0.5 + count, 0.5 + total - count) - betaln(0.5, 0.5)
    return float(mixed - xlogy(count, p) - xlog1py(total - count, -p))
