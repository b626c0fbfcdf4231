"""Rates with Wilson intervals and lower bounds, against values worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binom, binomtest

from cavsumo.results.statistics import lower_bound, rate

CALM = settings(deadline=None)


@pytest.mark.parametrize(
    ("count", "total", "low", "high"),
    [
        # z = 1.959964, z^2 = 3.841459; with no success the upper end is z^2 / (n + z^2).
        (0, 10, 0.0, 0.277533),
        (10, 10, 0.722467, 1.0),
        (0, 100, 0.0, 0.036994),
        # (p + z^2/2n -+ z sqrt(p (1-p)/n + z^2/4n^2)) / (1 + z^2/n)
        (5, 10, 0.236593, 0.763407),
        (58, 1000, 0.045133, 0.074250),
        (1, 1, 0.206549, 1.0),
    ],
)
def test_wilson_intervals_by_hand(count: int, total: int, low: float, high: float) -> None:
    """A share of nothing or everything still has an interval of some width."""
    found = rate(count, total)
    assert found.value == count / total
    assert found.low == pytest.approx(low, abs=1e-6)
    assert found.high == pytest.approx(high, abs=1e-6)


def test_no_trials_say_nothing() -> None:
    """A rate of zero trials is no rate, and overlaps with nothing."""
    found = rate(0, 0)
    assert (found.value, found.low, found.high) == (None, None, None)
    assert not found.overlaps(0.0, 1.0)


@CALM
@given(st.integers(1, 10_000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_an_interval_holds_its_rate_and_mirrors_its_opposite(trial: tuple[int, int]) -> None:
    """The interval of the failures is that of the successes, seen in the mirror."""
    count, total = trial
    found, opposite = rate(count, total), rate(total - count, total)
    assert found.value is not None
    assert found.low is not None
    assert found.high is not None
    assert opposite.high is not None
    assert 0.0 <= found.low <= found.value + 1e-12
    assert found.value - 1e-12 <= found.high <= 1.0
    assert found.low == pytest.approx(1.0 - opposite.high, abs=1e-9)


@pytest.mark.parametrize(
    ("low", "high", "overlapping"),
    [
        (0.0, 0.2, False),
        (0.0, 0.2366, True),
        (0.4, 0.5, True),
        (0.7634, 1.0, True),
        (0.8, 1, False),
    ],
)
def test_intervals_overlap_when_they_share_a_point(
    low: float, high: float, overlapping: bool
) -> None:
    """5 of 10 gives [0.2366, 0.7634]: what reaches into it is compatible with it."""
    assert rate(5, 10).overlaps(low, high) is overlapping


@pytest.mark.parametrize(
    ("count", "total", "confidence", "bound"),
    [
        # With nothing but successes it is the n-th root of 1 - confidence.
        (59, 59, 0.95, 0.05 ** (1 / 59)),
        (299, 299, 0.95, 0.05 ** (1 / 299)),
        (2995, 2995, 0.95, 0.05 ** (1 / 2995)),
        (58, 58, 0.95, 0.05 ** (1 / 58)),
        # P(X >= 1) = 1 - (1 - p)^n.
        (1, 20, 0.95, 1 - 0.95 ** (1 / 20)),
        (95, 100, 0.95, 0.897747),  # Clopper and Pearson, as R's binom.test has it
        (95, 100, 1 - 0.05 / 3, 0.881288),  # one of three, Bonferroni
        (0, 100, 0.95, 0.0),
    ],
)
def test_lower_bounds_by_hand(count: int, total: int, confidence: float, bound: float) -> None:
    """59 of 59 prove 0.95 and 58 do not; 299 of 299 prove 0.99."""
    found = lower_bound(count, total, confidence)
    assert found == pytest.approx(bound, abs=1e-6)
    assert (found >= 0.95) == (count == total >= 59)


@pytest.mark.parametrize("total", [1, 7, 59, 100])
@pytest.mark.parametrize("confidence", [0.9, 0.95, 1 - 0.05 / 3])
def test_a_lower_bound_holds_as_often_as_it_says(total: int, confidence: float) -> None:
    """Computed exactly: whatever p is, the bound exceeds it at most so often as it may."""
    counts = np.arange(total + 1)
    bounds = np.array([lower_bound(int(k), total, confidence) for k in counts])
    assert (np.diff(bounds) > 0).all()
    # Coverage is least just below a bound, where that bound fails and one more count does.
    for p in (*np.linspace(0.001, 0.999, 200), *(bounds[1:] - 1e-9)):
        covered = binom.pmf(counts, total, p)[bounds <= p].sum()
        assert covered >= confidence - 1e-9
    sharp = [binom.pmf(counts, total, b - 1e-9)[bounds <= b - 1e-9].sum() for b in bounds[1:]]
    assert max(sharp) == pytest.approx(confidence, abs=1e-6)  # nothing is given away


@CALM
@given(
    st.integers(1, 5_000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))),
    st.floats(0.5, 0.999),
)
def test_a_lower_bound_agrees_with_scipys(trial: tuple[int, int], confidence: float) -> None:
    """Another way to compute it: scipy's root finder."""
    test = binomtest(*trial, alternative="greater")
    expected = test.proportion_ci(confidence, method="exact").low
    assert lower_bound(*trial, confidence) == pytest.approx(expected, abs=1e-9)
