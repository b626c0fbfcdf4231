"""Rates with intervals."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Rate:
    """A share with its 95 % Wilson interval.

    Attributes:
        count, total: successes among trials.
        value: count / total, None when there were no trials.
        low, high: the interval (Wilson 1927, by scipy), None when there were no trials.
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


def rate(count: int, total: int) -> Rate:
    """The share of count among total."""
    if total == 0:
        return Rate(count, total, None, None, None)
    from scipy.stats import binomtest

    interval = binomtest(count, total).proportion_ci(0.95, method="wilson")
    return Rate(count, total, count / total, float(interval.low), float(interval.high))
