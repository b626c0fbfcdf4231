"""The report's statistics against published examples, statsmodels and simulations."""

from __future__ import annotations

import itertools
import math
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.stats import binom
from statsmodels.duration.survfunc import SurvfuncRight
from statsmodels.stats.contingency_tables import mcnemar as mcnemar_there
from statsmodels.stats.multitest import multipletests
from statsmodels.stats.proportion import proportion_confint

from cavsumo.report.distinct import Cell, diversity
from cavsumo.report.effort import per_second
from cavsumo.report.pairs import (
    Pairs,
    holm,
    mcnemar,
    ratio,
    ratio_interval,
    score,
    sequential_mcnemar,
    sequential_ratio_interval,
)
from cavsumo.results.kaplan_meier import (
    Curve,
    kaplan_meier,
    median_time_to_test,
    restricted_mean,
)
from cavsumo.results.statistics import rate, sequential_p, sequential_rate

CALM = settings(deadline=None, max_examples=50)
COUNTS = st.integers(1, 2000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n)))
FOURFOLD = st.builds(Pairs, *4 * [st.integers(0, 40)]).filter(lambda p: p.both + p.first + p.second)


# Shares


@pytest.mark.parametrize(
    ("count", "total", "wilson", "exact"),
    [
        # Newcombe 1998, Stat. Med. 17, 857, table I, methods 3 and 5
        (81, 263, (0.2553, 0.3662), (0.2527, 0.3676)),
        (15, 148, (0.0624, 0.1605), (0.0578, 0.1617)),
        (0, 20, (0.0000, 0.1611), (0.0000, 0.1684)),
        (1, 29, (0.0061, 0.1718), (0.0009, 0.1776)),
    ],
)
def test_newcombes_table(
    count: int, total: int, wilson: tuple[float, float], exact: tuple[float, float]
) -> None:
    """Both intervals as published, to the four digits given."""
    for method, ends in (("wilson", wilson), ("exact", exact)):
        found = rate(count, total, method)
        assert (found.low, found.high) == pytest.approx(ends, abs=5.1e-5)


@CALM
@given(COUNTS)
def test_intervals_are_those_of_statsmodels(trial: tuple[int, int]) -> None:
    """Wilson's and Clopper and Pearson's, whatever the counts."""
    for method, there in (("wilson", "wilson"), ("exact", "beta")):
        found = rate(*trial, method)
        expected = proportion_confint(*trial, method=there)
        assert (found.low, found.high) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("p", [0.03, 0.2, 0.5])
def test_shares_lie_in_their_intervals_often_enough(p: float) -> None:
    """Coverage, summed over all outcomes of 60 trials: the exact one never less than 95 %."""
    covered = {"wilson": 0.0, "exact": 0.0}
    for count in range(61):
        for method in covered:
            if rate(count, 60, method).overlaps(p, p):
                covered[method] += binom.pmf(count, 60, p)
    assert covered["exact"] >= 0.95
    assert 0.92 <= covered["wilson"] <= 0.985


def test_sequences_hold_at_every_time_and_wilsons_intervals_do_not() -> None:
    """Of 200 sequences of 300 trials hardly one ever leaves; Wilson's interval is left by many."""
    rng, p, steps = np.random.default_rng(7), 0.3, range(20, 301, 20)
    left_sequence = left_wilson = 0
    spans = {}
    for _ in range(200):
        counts = rng.random(300).__lt__(p).cumsum()
        trials = [(int(counts[n - 1]), n) for n in steps]
        for trial in trials:
            if trial not in spans:
                spans[trial] = sequential_rate(*trial), rate(*trial)
        left_sequence += any(not spans[t][0].overlaps(p, p) for t in trials)
        left_wilson += any(not spans[t][1].overlaps(p, p) for t in trials)
    assert left_sequence <= 10  # 5 %
    assert left_wilson > 30


def test_a_sequence_of_a_higher_level_is_wider() -> None:
    """97.5 % asks for more room than 95 %; the interval ends where its p-value is 5 %."""
    usual, wider = sequential_rate(30, 100), sequential_rate(30, 100, 0.975)
    assert usual.low is not None
    assert usual.high is not None
    assert wider.low is not None
    assert wider.high is not None
    assert wider.low < usual.low < 0.3 < usual.high < wider.high
    assert sequential_p(30, 100, usual.low) == pytest.approx(0.05, abs=1e-6)
    assert sequential_p(30, 100, wider.high) == pytest.approx(0.025, abs=1e-6)


# Pairs

AIRWAYS = Pairs(1, 1, 7, 12)  # Fagerland, Lydersen and Laake 2014, table II
APPROVAL = Pairs(794, 150, 86, 570)  # Agresti 2002, Categorical Data Analysis, table 10.1


def test_the_ratio_of_the_airways() -> None:
    """Ratio 2/8; the score interval of Fagerland et al. 2014, and their exact McNemar test."""
    assert ratio(AIRWAYS) == 0.25
    assert ratio_interval(AIRWAYS) == pytest.approx((0.065, 0.907), abs=5e-4)
    assert mcnemar(AIRWAYS) == pytest.approx(0.0703, abs=5e-5)


def test_the_approval_of_the_prime_minister() -> None:
    """Agresti's z is -4.17: the score statistic at ratio one is McNemar's, (150 - 86)^2 / 236."""
    assert ratio(APPROVAL) == pytest.approx(944 / 880)
    assert score(APPROVAL, 1.0) == pytest.approx(64**2 / 236)
    assert math.sqrt(score(APPROVAL, 1.0)) == pytest.approx(4.17, abs=0.005)
    expected = mcnemar_there([[794, 150], [86, 570]], exact=True).pvalue
    assert mcnemar(APPROVAL) == pytest.approx(expected, rel=1e-9)


@CALM
@given(FOURFOLD)
def test_mcnemar_is_that_of_statsmodels(pairs: Pairs) -> None:
    """The exact test, whatever the table; without discordant pairs there is no evidence."""
    table = [[pairs.both, pairs.first], [pairs.second, pairs.neither]]
    expected = mcnemar_there(table, exact=True).pvalue if pairs.first + pairs.second else 1.0
    assert mcnemar(pairs) == pytest.approx(expected, abs=1e-9)


@CALM
@given(FOURFOLD)
def test_the_ratio_seen_the_other_way(pairs: Pairs) -> None:
    """Swapping who is first turns the ratio and its interval over."""
    swapped = Pairs(pairs.both, pairs.second, pairs.first, pairs.neither)
    found, there = ratio_interval(pairs), ratio_interval(swapped)
    assert found is not None
    assert there is not None
    low, high = found
    assert low <= (ratio(pairs) or 0.0) <= high
    for end, other in ((low, there[1]), (high, there[0])):
        assert end * other == pytest.approx(1.0, rel=1e-6) or sorted((end, other)) == [0, math.inf]


@pytest.mark.parametrize("t", [0.3, 0.8, 1.7])
@pytest.mark.parametrize("pairs", [AIRWAYS, Pairs(20, 9, 4, 27), Pairs(3, 0, 5, 2)])
def test_the_score_uses_the_likeliest_table(pairs: Pairs, t: float) -> None:
    """The restricted maximum of the likelihood, found by search instead of by the formula."""
    n = pairs.total

    def cells(u: np.ndarray) -> tuple[float, ...]:
        second = 1 / (1 + math.exp(-u[0])) * min(1.0, 1 / t)  # its rate; the first's is t times it
        first = t * second
        least, most = max(0.0, first + second - 1), min(first, second)
        both = least + (most - least) / (1 + math.exp(-u[1]))
        return both, first - both, second - both, 1 - first - second + both

    def loss(u: np.ndarray) -> float:
        return -sum(k * math.log(max(c, 1e-300)) for k, c in zip(pairs, cells(u), strict=True) if k)

    starts = itertools.product((-1.0, 1.0), (-2.0, 2.0))
    options = {"xatol": 1e-10, "fatol": 1e-13, "maxiter": 4000}
    fits = [minimize(loss, s, method="Nelder-Mead", options=options) for s in starts]
    _, only_first, only_second, _ = cells(min(fits, key=lambda fit: fit.fun).x)
    departure = (pairs.both + pairs.first - t * (pairs.both + pairs.second)) / n
    # Var(p1 - t p2) where p1 = t p2
    variance = t * (only_first + only_second) / n
    assert score(pairs, t) == pytest.approx(departure**2 / variance, rel=1e-4)


@pytest.mark.parametrize(
    ("pairs", "found", "interval"),
    [
        (Pairs(0, 0, 0, 9), None, None),
        (Pairs(0, 0, 2, 8), 0.0, (0.0, 1.92)),
        (Pairs(0, 2, 0, 8), math.inf, (1 / 1.92, math.inf)),
    ],
)
def test_ratios_with_nothing_on_a_side(
    pairs: Pairs, found: float | None, interval: tuple[float, float] | None
) -> None:
    """No events at all say nothing; none on one side still bound the ratio: z^2 / 2 = 1.92."""
    assert ratio(pairs) == found
    expected = None if interval is None else pytest.approx(interval, rel=2e-3)
    assert ratio_interval(pairs) == expected


def test_ratios_lie_in_their_intervals_often_enough() -> None:
    """1000 tables of 60 dependent pairs, seeded: 95 % of the score intervals hold the ratio."""
    rng, p = np.random.default_rng(3), (0.15, 0.2, 0.08, 0.57)
    true = (p[0] + p[1]) / (p[0] + p[2])
    tables = [Pairs(*map(int, row)) for row in rng.multinomial(60, p, size=1000)]
    spans = {pairs: ratio_interval(pairs) for pairs in set(tables)}
    held = sum(span[0] <= true <= span[1] for t in tables if (span := spans[t]) is not None)
    assert 0.93 <= held / len(tables) <= 0.975


def test_ratios_and_p_values_hold_whenever_one_stops() -> None:
    """Looking after every twentieth of 200 pairs: at most 5 % ever mislead, McNemar's own do."""
    rng, p = np.random.default_rng(5), (0.1, 0.25, 0.25, 0.4)
    missed = rejected = plain = 0
    for _ in range(80):
        counts = np.eye(4, dtype=int)[rng.choice(4, size=200, p=p)].cumsum(axis=0)
        looks = [Pairs(*map(int, counts[n - 1])) for n in range(20, 201, 20)]
        spans = [sequential_ratio_interval(look) for look in looks]
        missed += any(span is not None and not span[0] <= 1.0 <= span[1] for span in spans)
        rejected += any(sequential_mcnemar(look) <= 0.05 for look in looks)
        plain += any(mcnemar(look) <= 0.05 for look in looks)
    assert missed <= 4
    assert rejected <= 4
    assert plain > 6


@pytest.mark.parametrize("seed", range(4))
def test_holm_is_that_of_statsmodels(seed: int) -> None:
    """Adjusted p-values, in the order given, some of them equal."""
    p_values = np.random.default_rng(seed).random(8).round(1 + seed).tolist()
    expected = multipletests(p_values, method="holm")[1]
    assert holm(p_values) == pytest.approx(list(expected), abs=1e-12)


def test_holm_by_hand() -> None:
    """The smallest times four, the next times three, never below one before: Holm's procedure."""
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])


# Time to the test

# Freireich et al. 1963: weeks of remission of acute leukaemia; Cox and Oakes 1984, table 1.1
REMISSION = [6, 6, 6, 7, 10, 13, 16, 22, 23]  # with 6-mercaptopurine, ended
CENSORED = [6, 9, 10, 11, 17, 19, 20, 25, 32, 32, 34, 35]
PLACEBO = [1, 1, 2, 2, 3, 4, 4, 5, 5, 8, 8, 8, 8, 11, 11, 12, 12, 15, 17, 22, 23]


def curve(ended: list[float], censored: list[float]) -> Curve:
    """The estimate of some times."""
    times = np.array([*ended, *censored], float)
    found = kaplan_meier(times, np.arange(len(times)) < len(ended))
    assert found is not None
    return found


def test_the_remission_of_leukaemia() -> None:
    """The published curve and medians: 23 weeks, and 8 with a placebo."""
    treated, placebo = curve(REMISSION, CENSORED), curve(PLACEBO, [])
    after = dict(zip(treated.times, treated.share, strict=True))
    published = {6: 0.857, 7: 0.807, 10: 0.753, 13: 0.690, 16: 0.627, 22: 0.538, 23: 0.448}
    assert {t: after[t] for t in published} == pytest.approx(published, abs=6e-4)
    # the limits by log(-log), as R's survival gives them
    assert median_time_to_test(treated) == (23.0, (13.0, math.inf))
    assert median_time_to_test(placebo) == (8.0, (4.0, 11.0))


@pytest.mark.parametrize("seed", range(5))
def test_curves_are_those_of_statsmodels(seed: int) -> None:
    """Shares, numbers at risk, medians, and the interval from Greenwood's standard error."""
    rng = np.random.default_rng(seed)
    times, events = np.round(rng.exponential(8, 60), 1), rng.random(60) < 0.6
    found, there = kaplan_meier(times, events), SurvfuncRight(times, events.astype(int))
    assert found is not None
    at = np.searchsorted(found.times, there.surv_times)
    assert found.share[at] == pytest.approx(there.surv_prob)
    assert found.at_risk[at] == pytest.approx(there.n_risk)
    assert found.events[at] == pytest.approx(there.n_events)
    share, error = there.surv_prob, there.surv_prob_se
    inside = (share > 0) & (share < 1)
    spread = 1.959964 * error[inside] / (share[inside] * np.abs(np.log(share[inside])))
    for ends, power in ((found.low, np.exp(spread)), (found.high, np.exp(-spread))):
        assert ends[at][inside] == pytest.approx(share[inside] ** power, abs=1e-6)
    assert median_time_to_test(found)[0] == there.quantile(0.5)


def test_the_mean_up_to_a_limit_by_hand() -> None:
    """Tests at 1 and 3, an end at 2, and a limit of 4: 1 + 2 * 2/3 + 1 * 0, and Greenwood's sum."""
    found = curve([1, 3], [2])
    mean, span = restricted_mean(found, 4.0)
    assert mean == pytest.approx(1 + 2 * 2 / 3)
    # at 1: area after 4/3, d / (n (n - d)) = 1/6; at 3 nobody is left
    half = 1.959964 * math.sqrt((4 / 3) ** 2 / 6)
    assert span == pytest.approx((mean - half, min(4.0, mean + half)))
    assert restricted_mean(curve([], [2, 3]), 2.5) == (2.5, None)


def test_means_and_medians_lie_in_their_intervals_often_enough() -> None:
    """300 samples of 80 exponential times with censoring, seeded; the truth is known."""
    rng, limit = np.random.default_rng(11), 10.0
    true_mean, true_median = 8 * (1 - math.exp(-limit / 8)), 8 * math.log(2)
    means = medians = 0
    for _ in range(300):
        times, ends = rng.exponential(8, 80), rng.uniform(2, 30, 80)
        found = kaplan_meier(np.minimum(times, ends), times <= ends)
        assert found is not None
        span = restricted_mean(found, limit)[1]
        means += span is not None and span[0] <= true_mean <= span[1]
        span = median_time_to_test(found)[1]
        medians += span is not None and span[0] <= true_median <= span[1]
    assert 0.91 <= means / 300 <= 0.98
    assert 0.91 <= medians / 300 <= 0.99


@pytest.mark.parametrize(
    ("ended", "censored", "expected"),
    [([], [4, 5], (None, None)), ([3], [], (3.0, (0.0, math.inf))), ([0, 0], [], None)],
)
def test_few_times(ended: list[float], censored: list[float], expected: object) -> None:
    """No test at all, one test, tests at the very start: an answer without a warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = median_time_to_test(curve(ended, censored))
    if expected is not None:
        assert found == expected
    assert kaplan_meier(np.array([]), np.array([], bool)) is None


# Figures per second


def test_figures_per_second_lie_in_their_intervals_often_enough() -> None:
    """Episodes that end with their test: 500 batches of 60, of a known rate."""
    rng, held = np.random.default_rng(2), 0
    true = (1 - math.exp(-2.0)) / (5 * (1 - math.exp(-2.0)))  # tests over time: the hazard, 1/5
    for _ in range(500):
        times = rng.exponential(5, 60)
        found = per_second((times < 10).astype(float), np.minimum(times, 10))
        assert found.interval is not None
        held += found.interval[0] <= true <= found.interval[1]
    assert 0.92 <= held / 500 <= 0.975


def test_figures_per_second_of_little() -> None:
    """No time gives no figure; nothing found gives zero and no interval that would pretend."""
    none = per_second(np.array([]), np.array([]))
    assert (none.value, none.interval) == (None, None)
    zero = per_second(np.zeros(3), np.ones(3))
    assert (zero.value, zero.interval) == (0.0, None)
    assert per_second(np.array([1.0, 0.0]), np.array([2.0, 2.0])).value == 0.25


# What is distinct


def test_cells_met_and_not_met_by_hand() -> None:
    """Of 9 known: four cells once, one twice, one three times; 6 + 4 * 3 / (2 * 2) = 9 in all."""
    names = ["a", "b", "c", "d", "e", "e", "f", "f", "f"]
    cells = [Cell("", "pedestrian", name, 0.0, 0.0) for name in names]
    found = diversity([*cells, None])
    assert (found.total, found.known, found.cells) == (10, 9, 6)
    assert found.estimate == 9.0
    assert found.new == pytest.approx(4 / 9)


def test_cells_of_nothing() -> None:
    """Nothing known says nothing; one known, that the next may well be new."""
    assert diversity([None]).estimate is None
    assert diversity([]).new is None
    assert diversity([Cell("", "car", "left", 0.0, 0.0)]).new == 1.0
