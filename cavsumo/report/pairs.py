"""Paired proportions: two testers on the same seeds, as a table of two by two."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from cavsumo.results.statistics import Interval, sequential_p, sequential_rate

Z2 = 1.959963984540054**2  # squared, of a 95 % interval


class Pairs(NamedTuple):
    """Pairs of episodes by their events.

    Attributes:
        both, first, second, neither: numbers of pairs with the event in both episodes, in the first
            or the second only, or in neither.
    """

    both: int
    first: int
    second: int
    neither: int

    @property
    def total(self) -> int:
        """The number of pairs."""
        return sum(self)


def ratio(pairs: Pairs) -> float | None:
    """The first's rate over the second's; infinite over none, None when neither has any."""
    over, under = pairs.both + pairs.first, pairs.both + pairs.second
    if under:
        return over / under
    return math.inf if over else None


def ratio_interval(pairs: Pairs) -> Interval | None:
    """The 95 % score interval of the ratio of two paired proportions.

    Nam and Blackwelder 2002, Stat. Med. 21, 689; the same as Tang, Tang and Chan 2003, and one of
    those that Fagerland, Lydersen and Laake 2014, Stat. Med. 33, 2850 recommend. It holds the
    ratios t for which the score statistic, with the likelihood's maximum under the ratio t for its
    variance, is below the normal quantile. None when neither has any.
    """
    found = ratio(pairs)
    if found is None:
        return None

    def excess(log_t: float) -> float:
        return score(pairs, math.exp(log_t)) - Z2

    low = _root(excess, found, -1) if found > 0 else 0.0
    high = _root(excess, found, +1) if math.isfinite(found) else math.inf
    return low, high


def score(pairs: Pairs, t: float) -> float:
    """The squared score statistic of the hypothesis that the ratio is t > 0."""
    n = pairs.total
    first, second = (pairs.both + pairs.first) / n, (pairs.both + pairs.second) / n
    departure = first - t * second
    if departure == 0.0:
        return 0.0
    p10 = _only_first(pairs, t)
    p01 = t * p10 - (t - 1) * (1 - pairs.neither / n)
    variance = t * (p10 + p01) / n
    return departure * departure / variance if variance > 0.0 else math.inf


def _only_first(pairs: Pairs, t: float) -> float:
    """The likeliest probability of "only the first" if the ratio is t."""
    n = pairs.total
    first, second = (pairs.both + pairs.first) / n, (pairs.both + pairs.second) / n
    p10, p01 = pairs.first / n, pairs.second / n
    root = math.sqrt((first - t * t * second) ** 2 + 4 * t * t * p10 * p01)
    return (-first + t * t * (second + 2 * p10) + root) / (2 * t * (t + 1))


def _root(excess: Callable[[float], float], start: float, side: int) -> float:
    """The ratio, to one side of the start, at which an excess leaves zero."""
    from scipy.optimize import brentq

    inside = start > 0 and math.isfinite(start)
    near = math.log(start) if inside else -25.0 * side  # or from the other end
    far = near
    for _ in range(60):
        far += side
        if excess(far) > 0:
            return math.exp(float(brentq(excess, near, far, xtol=1e-12)))
    return math.inf if side > 0 else 0.0


def sequential_ratio_interval(pairs: Pairs) -> Interval | None:
    """An interval of the ratio that is valid at any stopping time, at least 95 %.

    From the confidence sequences of both rates at 97.5 % (Bonferroni); wide, because it does not
    use the pairing.
    """
    if ratio(pairs) is None:
        return None
    over = sequential_rate(pairs.both + pairs.first, pairs.total, 0.975)
    under = sequential_rate(pairs.both + pairs.second, pairs.total, 0.975)
    assert over.low is not None
    assert over.high is not None
    assert under.low is not None
    assert under.high is not None
    return over.low / under.high, over.high / under.low if under.low > 0 else math.inf


def mcnemar(pairs: Pairs) -> float:
    """The two-sided p-value of McNemar's test, exact: binomial, not mid-p.

    McNemar 1947, Psychometrika 12, 153. Of the pairs in which only one episode has the event, both
    cases are equally likely.
    """
    from scipy.stats import binomtest

    only = pairs.first + pairs.second
    return float(binomtest(pairs.first, only, 0.5).pvalue) if only else 1.0


def sequential_mcnemar(pairs: Pairs) -> float:
    """The same, valid at any stopping time."""
    return sequential_p(pairs.first, pairs.first + pairs.second)


def holm(p_values: Sequence[float]) -> list[float]:
    """P-values adjusted so that all of them together hold (Holm 1979, Scand. J. Stat. 6, 65)."""
    adjusted = [0.0] * len(p_values)
    largest = 0.0
    for rank, i in enumerate(sorted(range(len(p_values)), key=p_values.__getitem__)):
        largest = max(largest, min(1.0, (len(p_values) - rank) * p_values[i]))
        adjusted[i] = largest
    return adjusted
