"""The time to the first test: within an episode, with censoring, and across the batch.

Within an episode the time to the trigger is estimated by Kaplan and Meier (1958, J. Am. Stat.
Assoc. 53, 457; by scipy), with the log-log interval on Greenwood's variance. An episode without a
test is censored at its end. So is an unfair one: it shows that there was no test so far, and not
when there would have been one; counting it as a test would reward testers that are unfair quickly.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas
from numpy.typing import NDArray

from cavsumo.report.compare import EVENTS
from cavsumo.report.grouping import Group, Told
from cavsumo.report.pairs import Interval

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Curve:
    """The share of episodes without a test so far.

    Attributes:
        times: times of its changes and of censoring [s], ascending.
        share: from each of these times on.
        low, high: its pointwise 95 % interval, NaN where there is none.
        at_risk, events: numbers of episodes still running just before, and of tests then.
    """

    times: Floats
    share: Floats
    low: Floats
    high: Floats
    at_risk: Floats
    events: Floats


@dataclass(frozen=True)
class TimeToTest(Told):
    """The times of tests.

    Attributes:
        tests, censored: numbers of episodes with and without a test.
        median: the time by which half of the episodes would have had a test [s]; None when fewer
            have one before the last is censored.
        median_interval: its 95 % interval [s], where the curve's interval crosses one half
            (Brookmeyer and Crowley 1982, Biometrics 38, 29); the end may be infinite.
        mean, mean_interval: the mean time without a test up to the limit [s], normal interval; no
            interval without any test before the limit.
        limit: the time up to which the mean is taken [s], one for all groups.
        first_test, first_failure: number of the first of the group's valid episodes, from 1; None
            for none (that is, more than all of them).
        curve: the estimate; None without episodes.
    """

    tests: int
    censored: int
    median: float | None
    median_interval: Interval | None
    mean: float | None
    mean_interval: Interval | None
    limit: float | None
    first_test: int | None
    first_failure: int | None
    curve: Curve | None


def times_to_test(groups: Sequence[Group]) -> list[TimeToTest]:
    """One estimate per group, with a common limit for the means."""
    curves = [kaplan_meier(*times_and_events(group.valid)) for group in groups]
    limit = min((float(curve.times[-1]) for curve in curves if curve is not None), default=None)
    return [_estimate(group, curve, limit) for group, curve in zip(groups, curves, strict=True)]


def times_and_events(valid: pandas.DataFrame) -> tuple[Floats, NDArray[np.bool_]]:
    """For each episode the time of its test, or of its end, and whether it was a test."""
    tests = EVENTS["tests"](valid)
    times = valid["trigger_time_s"].where(tests, valid["time_s"])
    return times.to_numpy(float), tests.to_numpy(bool)


def kaplan_meier(times: Floats, events: NDArray[np.bool_]) -> Curve | None:
    """The estimate with its interval, None without episodes."""
    if not len(times):
        return None
    from scipy.stats import CensoredData, ecdf

    survival = ecdf(CensoredData(uncensored=times[events], right=times[~events])).sf
    with warnings.catch_warnings(), np.errstate(all="ignore"):  # none where the share is 1 or 0
        warnings.simplefilter("ignore", RuntimeWarning)
        interval = survival.confidence_interval(0.95, method="log-log")
    moments = survival.quantiles
    ordered, tests = np.sort(times), np.sort(times[events])
    at_risk = len(times) - np.searchsorted(ordered, moments, side="left")
    died = np.searchsorted(tests, moments, "right") - np.searchsorted(tests, moments, "left")
    return Curve(
        moments,
        survival.probabilities,
        interval.low.probabilities,
        interval.high.probabilities,
        at_risk.astype(float),
        died.astype(float),
    )


def median(curve: Curve) -> tuple[float | None, Interval | None]:
    """The time at which the curve reaches one half, with its interval."""
    middle = _first_at_half(curve.times, curve.share)
    low, high = _first_at_half(curve.times, curve.low), _first_at_half(curve.times, curve.high)
    if middle is None and low is None:
        return None, None
    return middle, (low if low is not None else 0.0, math.inf if high is None else high)


def _first_at_half(times: Floats, values: Floats) -> float | None:
    """The first time at which values are one half or less, None for never."""
    reached = np.flatnonzero(values <= 0.5)  # False for NaN
    return float(times[reached[0]]) if len(reached) else None


def restricted_mean(curve: Curve, limit: float) -> tuple[float, Interval | None]:
    """The area under the curve up to a limit, with its interval by Greenwood's variance.

    No test before the limit leaves nothing to estimate a variance from, and so no interval.

    Karrison 1987, J. Am. Stat. Assoc. 82, 1169: the sum over the times of tests of the area that
    still follows, squared, times d / (n (n - d)).
    """
    inside = curve.times < limit
    times, share = curve.times[inside], curve.share[inside]
    edges = np.concatenate(([0.0], times, [limit]))
    areas = np.diff(edges) * np.concatenate(([1.0], share))
    mean = float(areas.sum())
    after = areas[::-1].cumsum()[::-1][1:]  # the area from each time on
    at_risk, died = curve.at_risk[inside], curve.events[inside]
    left = at_risk - died
    terms = np.divide(died, at_risk * left, out=np.zeros_like(died), where=left > 0)
    variance = float((after**2 * terms).sum())
    if variance == 0.0:
        return mean, None
    half = 1.959963984540054 * math.sqrt(variance)
    return mean, (max(0.0, mean - half), min(limit, mean + half))


def _estimate(group: Group, curve: Curve | None, limit: float | None) -> TimeToTest:
    """The estimate of one group."""
    valid = group.valid
    tests = int(EVENTS["tests"](valid).sum())
    middle, around = median(curve) if curve is not None else (None, None)
    mean, near = (None, None)
    if curve is not None and limit is not None:
        mean, near = restricted_mean(curve, limit)
    return TimeToTest(
        *group.whose,
        tests=tests,
        censored=len(valid) - tests,
        median=middle,
        median_interval=around,
        mean=mean,
        mean_interval=near,
        limit=limit,
        first_test=_first(EVENTS["tests"](valid)),
        first_failure=_first(EVENTS["failures"](valid)),
        curve=curve,
    )


def _first(happened: pandas.Series) -> int | None:
    """The number of the first episode with an event, from 1."""
    return int(happened.to_numpy().argmax()) + 1 if happened.any() else None
