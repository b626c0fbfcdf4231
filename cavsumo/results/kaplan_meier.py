"""The time to a test within an episode, with censoring.

It is estimated by Kaplan and Meier (1958, J. Am. Stat. Assoc. 53, 457; by scipy), with the log-log
interval on Greenwood's variance. An episode without a test is censored at its end. So is an unfair
one: the tester came too early for a test, which says that there was none so far and not when there
would have been one; to count it as a test would reward testers that are unfair quickly.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cavsumo.results.statistics import Interval

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Curve:
    """The share of episodes without a test so far.

    Attributes:
        times: when it changes, and when an episode was censored [s], ascending.
        share: from each of these times on.
        low, high: its pointwise 95 % interval, NaN where there is none.
        at_risk, events: how many episodes still ran just before, how many tests came then.
    """

    times: Floats
    share: Floats
    low: Floats
    high: Floats
    at_risk: Floats
    events: Floats


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


def median_time_to_test(curve: Curve) -> tuple[float | None, Interval | None]:
    """When the curve reaches one half, and between which times that lies; None for not so far.

    The time by which half of the episodes would have had a test, those without one included: the
    one median that summary and report show.
    """
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


def median_in_words(curve: Curve | None) -> str:
    """The median in seconds; a bound where less than half had a test, empty without episodes."""
    if curve is None:
        return ""
    middle, _ = median_time_to_test(curve)
    return f"> {curve.times[-1]:.1f}" if middle is None else f"{middle:.1f}"
