"""Published crosswalks step by step, and the estimators that work over time on them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.stats import norm

from cavsumo.model.crosswalk import STARTS, failures
from cavsumo.probability import failure_chances, learned_splitting, shifted
from cavsumo.probability.disturbed_crosswalk import DisturbedCrosswalk
from cavsumo.probability.failure_chances import explored_states, learned_chances
from cavsumo.probability.learned_splitting import estimate_by_splitting
from cavsumo.probability.noisy import ENDED, FAILED, RUNNING, NoisyProcess, counted
from cavsumo.probability.shifted import (
    estimate_by_shifts,
    explored_runs,
    learned_mixture,
    shifted_runs,
)
from cavsumo.probability.shifts import IN_SQUARES, IN_TIME, FailingRuns, fitted, latest
from cavsumo.probability.splitting import split
from cavsumo.probability.tree import Floats
from cavsumo.probability.yielding_crosswalk import (
    YieldingCrosswalk,
    chosen_acceleration,
    following_acceleration,
    overlapping,
)


@dataclasses.dataclass(frozen=True)
class Sum:
    """Ten steps of one number each; a run fails when their sum passes 8: 1 - Phi(8 / sqrt 10)."""

    horizon: int = 10
    numbers: int = 1

    def begin(self, count: int) -> Floats:
        """Time, sum and whether it runs."""
        return np.zeros((count, 3))

    def moved(self, states: Floats, drawn: Floats) -> Floats:
        """Add a number; only the sum at the end counts."""
        time, total = states[:, 0] + 1.0, states[:, 1] + drawn[:, 0]
        last = np.where(time < 10.0, RUNNING, np.where(total > 8.0, FAILED, ENDED))
        return np.stack([time, total, last], axis=1)

    def features(self, states: Floats) -> Floats:
        """The sum, scaled."""
        return states[:, 1:2] / 5.0


SUM_P = 0.005706  # 1 - Phi(8 / sqrt(10))


class Never(Sum):
    """The sum, where nothing fails."""

    def moved(self, states: Floats, drawn: Floats) -> Floats:
        """As for the sum; a run that failed there has ended."""
        found = super().moved(states, drawn)
        found[:, 2] = np.where(found[:, 2] == FAILED, ENDED, found[:, 2])
        return found


@pytest.fixture
def few_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two rounds of learning from few runs."""
    monkeypatch.setattr(learned_splitting, "EXPLORED", 1000)
    monkeypatch.setattr(learned_splitting, "ROUNDS", 2)
    monkeypatch.setattr(learned_splitting, "PILOTS", (2, 100))


def played(process: NoisyProcess, numbers: Floats) -> Floats:
    """The last states of runs with given numbers, shape (n, horizon, numbers)."""
    states = process.begin(len(numbers))
    for step in range(process.horizon):
        go = np.flatnonzero(states[:, -1] == RUNNING)
        states[go] = process.moved(states[go], numbers[go, step])
    return states


@pytest.mark.parametrize("start", STARTS)
def test_the_stress_tests_crosswalk_is_the_one_of_the_suite(start: object) -> None:
    """With the same numbers the same runs fail."""
    process = DisturbedCrosswalk(start)  # type: ignore[arg-type]
    numbers = 1.3 * np.random.default_rng(4).standard_normal((800, 50, 4))
    failed = played(process, numbers)[:, -1] == FAILED
    assert (failed == failures(process.start, numbers)).all()
    assert failed.any()


def test_the_yielding_car_stops_before_the_crosswalk() -> None:
    """Without noise: the pedestrian walks at 1 m/s, and the car waits before the line."""
    process = YieldingCrosswalk()
    states, speeds = process.begin(1), []
    while states[0, -1] == RUNNING:
        states = process.moved(states, np.zeros((1, 5)))
        speeds.append(states[0, 5])
    assert states[0, -1] == ENDED
    assert states[0, 0] > 13.0
    assert states[0, 2] == pytest.approx(1.0, abs=0.02)
    assert min(speeds) < 1.0
    assert states[0, 4] + 2.0 < 22.0


def test_the_yielding_car_by_hand() -> None:
    """Free driving, a standing leader, and a crosswalk that is clear as somebody has left it."""
    one = np.ones(1)
    assert following_acceleration(8.0 * one, 0.0 * one, 22.0 * one)[0] == pytest.approx(
        3.0 * (1 - 0.8**4 - ((5 + 12 + 64 / (2 * 6**0.5)) / 22) ** 2)
    )
    assert following_acceleration(one, 0.0 * one, -one)[0] == -9.0
    left = chosen_acceleration(0.0 * one, 8.0 * one, 15.0 * one, 0.0 * one, one)
    assert left[0] == pytest.approx(2.0)
    inside = chosen_acceleration(0.0 * one, 8.0 * one, 8.0 * one, 0.0 * one, one)
    assert inside[0] == following_acceleration(8.0 * one, 0.0 * one, 22.0 * one)[0]


def test_boxes_overlap_as_they_are_turned() -> None:
    """A pedestrian beside the car at 1.41 m: only a box turned by 45 degrees reaches it."""
    straight = [10.0 + 1.41, 0.0, 1.0, 0.0, 25.0, 0.0, RUNNING]
    turned = [10.0 + 1.41, 0.0, 1.0, 1.0, 25.0, 0.0, RUNNING]
    away = [10.0 + 1.61, 0.0, 1.0, 1.0, 25.0, 0.0, RUNNING]
    found = overlapping(np.array([straight, turned, away]))
    assert found.tolist() == [False, True, False]


def test_runs_by_chance_are_counted() -> None:
    """Of 40,000 runs about 228 fail; all have ten steps."""
    found = counted(Sum(), 40_000, np.random.default_rng(1))
    assert (found.runs, found.steps) == (40_000, 400_000)
    assert found.failures == pytest.approx(40_000 * SUM_P, abs=60)


def test_splitting_is_unbiased() -> None:
    """Many small replicas by a crude score: their mean is the probability."""

    def score(states: Floats, step: int) -> Floats:
        return np.where(states[:, 2] == FAILED, 100.0, states[:, 1] + 0.5 * (10.0 - step))

    found = split(Sum(), score, np.random.default_rng(2), 300, 40)
    error = found.estimates.std() / 300**0.5
    assert abs(found.estimates.mean() - SUM_P) < 4.0 * error
    assert error < 0.1 * SUM_P


def test_the_chances_to_fail_are_learned() -> None:
    """Those of the sum, 1 - Phi((8 - sum) / sqrt(steps that are left)), by less than a factor e."""
    rng = np.random.default_rng(3)
    learned = learned_chances(Sum(), explored_states(Sum(), 3000, rng), rng)
    for step, total in ((0, 0.0), (4, 3.0), (4, -1.0), (8, 5.0), (9, 7.5)):
        found = learned.chances.log(np.array([[step, total, RUNNING]]), step)[0]
        exact = norm.logsf((8.0 - total) / (10.0 - step) ** 0.5)
        assert found == pytest.approx(exact, abs=1.0)
    ended = np.array([[10.0, 9.0, FAILED], [10.0, 1.0, ENDED]])
    assert learned.chances.log(ended, 10).tolist() == [0.0, failure_chances.FLOOR]


def test_splitting_by_learned_chances_covers_and_repeats(few_runs: None) -> None:
    """Ten estimates: at most one interval misses; the same generator, the same digits."""
    found = [estimate_by_splitting(Sum(), np.random.default_rng(s), 10, 100) for s in range(10)]
    assert found[3] == estimate_by_splitting(Sum(), np.random.default_rng(3), 10, 100)
    each = [one.estimate for one in found]
    assert not any(one.refused for one in each)
    assert sum(one.lower <= SUM_P <= one.upper for one in each) >= 9
    assert np.mean([one.p for one in each]) == pytest.approx(SUM_P, rel=0.1)
    assert all(one.episodes > 1000 for one in each)


def test_splitting_is_refused_where_nothing_is_reached(few_runs: None) -> None:
    """Nothing fails, so nothing is learned and nothing is claimed."""
    found = estimate_by_splitting(Never(), np.random.default_rng(1), 5, 10)
    assert found.estimate.refused == "no replica reached a failure"


def test_shifts_cover_and_gain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ten estimates of few runs: the mean is the probability, at most one interval misses it."""
    monkeypatch.setattr(shifted, "LEARNED", (1000, 1000))
    found = [estimate_by_shifts(Sum(), np.random.default_rng(s), 2000).estimate for s in range(10)]
    assert not any(one.refused for one in found)
    assert sum(one.lower <= SUM_P <= one.upper for one in found) >= 9
    assert np.mean([one.p for one in found]) == pytest.approx(SUM_P, rel=0.05)
    assert np.std([one.p for one in found]) < 0.3 * (SUM_P / 2000) ** 0.5


def test_wide_exploration_is_weighed_exactly() -> None:
    """Runs that are spread wider are an estimate, too, and so are those of any mixture."""
    rng = np.random.default_rng(3)
    wide = explored_runs(Sum(), 40_000, rng)
    assert wide.terms.mean() == pytest.approx(SUM_P, rel=0.15)
    mixture = learned_mixture([wide])
    assert sum(one.share for one in mixture) == pytest.approx(1.0)
    far = [
        one._replace(shift=dataclasses.replace(one.shift, variances=1.2 * one.shift.variances))
        if one.shift
        else one
        for one in mixture
    ]
    assert shifted_runs(Sum(), far, 40_000, rng).terms.mean() == pytest.approx(SUM_P, rel=0.1)


def test_the_runs_that_fail_late_have_a_shift_of_their_own() -> None:
    """A third of the runs, with their own steps; all where they last alike."""
    owner = np.repeat([0, 1, 2], [2, 4, 3])
    rows = np.arange(9.0)[:, None]
    runs = FailingRuns(np.array([0.0, 1.0, 2.0]), rows, rows[:, 0] / 9.0, rows, owner)
    late = latest(runs)
    assert late.logs.tolist() == [1.0]
    assert late.features[:, 0].tolist() == [2.0, 3.0, 4.0, 5.0]
    assert late.owner.tolist() == [0] * 4
    alike = dataclasses.replace(runs, owner=np.repeat([0, 1, 2], 3))
    assert latest(alike).count == 3


def test_a_shift_is_fitted_to_numbers_that_depend_on_the_state() -> None:
    """Numbers of mean x / 2 and deviation 0.8: both forms find them."""
    rng = np.random.default_rng(1)
    x = rng.uniform(-1.0, 1.0, (20_000, 1))
    drawn = x / 2 + 0.8 * rng.standard_normal(x.shape)
    owner = np.repeat(np.arange(2000), 10)
    runs = FailingRuns(np.zeros(2000), x, np.tile(np.arange(10) / 10, 2000), drawn, owner)
    for form in (IN_TIME, IN_SQUARES):
        found = fitted(form, runs, 150.0)
        mean = found.mean(np.array([[1.0], [-1.0]]), np.array([0.5, 0.5]))
        assert mean[:, 0] == pytest.approx([0.5, -0.5], abs=0.05)
        assert found.deviation(0.5)[0] == pytest.approx(0.8, abs=0.03)


def test_shifts_are_refused_without_failures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing fails, so nothing is learned and nothing is claimed."""
    monkeypatch.setattr(shifted, "EXPLORED", 100)
    monkeypatch.setattr(shifted, "LEARNED", (100,))
    found = estimate_by_shifts(Never(), np.random.default_rng(1), 100)
    assert found.estimate.refused == "no failure was drawn"


def test_the_yielding_crosswalk_is_estimated_as_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Monte Carlo counted 6.22e-5 (published: 5.9e-5); an estimate of few runs is near both."""
    monkeypatch.setattr(shifted, "LEARNED", (1000, 1000, 1000))
    found = estimate_by_shifts(YieldingCrosswalk(), np.random.default_rng(1), 3000).estimate
    assert found.refused == ""
    assert found.p == pytest.approx(6.2e-5, rel=0.2)
