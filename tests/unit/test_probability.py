"""Estimators of failure probabilities on functions of known probability, exposures, encounters."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cavsumo.errors import InputError
from cavsumo.model.bodies import BICYCLE, BUS, PEDESTRIAN
from cavsumo.model.scenario import BatchPlan
from cavsumo.network.site import Site
from cavsumo.probability.distributions import Exponential, Histogram, LogNormal, Normal
from cavsumo.probability.encounters import encounters_of
from cavsumo.probability.exposure import Exposure, read_exposure
from cavsumo.probability.kernels import learned, uniform
from cavsumo.probability.methods import ESTIMATORS
from cavsumo.probability.monte_carlo import exact_estimate, needed_without_failure
from cavsumo.probability.protocol import ALL_PLAYED, Estimator, Goal, PlayedVector, looks
from cavsumo.probability.ratio import ratio_of
from cavsumo.probability.stratified import Cut, Stratified, allocated, bounds, weighted_counts
from cavsumo.probability.tree import Floats
from cavsumo.probability.vehicle_encounters import VehicleEncounters

NEVER = 1e-9  # a half-width that is not reached


def corner(u: Floats) -> Floats:
    """Above 0 with probability 1e-4: in a corner of three of four coordinates."""
    found: Floats = 1e-4 ** (1 / 3) - u[:, :3].max(1)
    return found


def scattered(u: Floats) -> Floats:
    """Above 0 with probability 1e-3, with no place and no sign of coming near."""
    found: Floats = 1e-3 - (997.0 * u.sum(1)) % 1.0
    return np.where(found > 0.0, found, -((13.0 * u.sum(1)) % 1.0))


def played(estimator: Estimator, margin: Callable[[Floats], Floats]) -> Estimator:
    """An estimator that was told of all vectors it asked for."""
    while not estimator.over:
        margins = margin(estimator.ask())
        estimator.tell([PlayedVector(bool(m > 0.0), float(m)) for m in margins])
    return estimator


def made(method: str, goal: Goal, seed: int) -> Estimator:
    """An estimator in four dimensions."""
    return ESTIMATORS[method](4, goal, np.random.default_rng(seed))


@pytest.mark.parametrize("method", ESTIMATORS)
def test_an_estimate_is_a_function_of_its_generator(method: str) -> None:
    """Twice the same digits; all episodes are played, and no more."""
    goal = Goal(1000, NEVER)
    one, two = (played(made(method, goal, 3), corner) for _ in range(2))
    assert one.history == two.history
    assert one.over == ALL_PLAYED
    assert one.history[-1].episodes == 1000


@pytest.mark.parametrize("method", ESTIMATORS)
@pytest.mark.parametrize("seed", [1, 2])
def test_other_events_have_an_estimate_by_the_same_vectors(method: str, seed: int) -> None:
    """That of the failures themselves is the headline; two parts of them sum to it."""
    estimator = made(method, Goal(4000, NEVER), seed)
    failed, part = list[bool](), list[bool]()
    while not estimator.over:
        asked = estimator.ask()
        told = [bool(m > 0.0) for m in corner(asked) + 0.2]
        failed += told
        part += [bool(u > 0.5) for u in asked[:, 3]]
        estimator.tell([PlayedVector(one, 0.0) for one in told])
    whole, first = np.array(failed), np.array(failed) & np.array(part)
    assert dataclasses.replace(estimator.of(whole), refused="") == dataclasses.replace(
        estimator.history[-1], refused=""
    )
    parts = estimator.of(first), estimator.of(whole & ~first)
    assert sum(one.p for one in parts) == pytest.approx(estimator.history[-1].p)
    assert all(one.failures > 0 and one.lower < one.p < one.upper for one in parts)


@pytest.mark.parametrize(("method", "episodes"), [("importance", 4000), ("auto", 6000)])
def test_a_rare_corner_is_estimated_with_a_gain(method: str, episodes: int) -> None:
    """Twenty estimates by 4,000 vectors, of which Monte Carlo expects 0.4 to fail; or by 6,000."""
    found = [played(made(method, Goal(episodes, NEVER), seed), corner) for seed in range(20)]
    last = [one.history[-1] for one in found]
    good = [one for one in last if not one.refused]
    assert len(good) >= 18
    assert sum(one.lower <= 1e-4 <= one.upper for one in good) >= len(good) - 2
    assert sum(one.gain()[0] > 10.0 for one in found) >= 10


def test_importance_sampling_is_refused_where_nothing_can_be_learned() -> None:
    """Scattered failures: no interval is given; Monte Carlo takes over if it may."""
    last = [played(made("importance", Goal(2000, NEVER), s), scattered).history[-1] for s in (1, 2)]
    assert all(one.refused for one in last)
    chosen = [played(made("auto", Goal(5000, NEVER), s), scattered).history[-1] for s in (1, 2)]
    assert not any(one.refused for one in chosen)
    assert all(one.lower <= 1e-3 <= one.upper for one in chosen)


def test_few_episodes_are_not_spent_on_pilots() -> None:
    """The automatic choice of fewer than 5,000 is Monte Carlo: the same vectors and estimates."""
    assert made("auto", Goal(2000), 3).gain() == (1.0, 1.0, 1.0)  # before the first look
    goals = Goal(2000, 0.3), Goal(4999, NEVER)
    for goal in goals:
        chosen, plain = (played(made(m, goal, 3), corner) for m in ("auto", "monte-carlo"))
        assert chosen.history == plain.history
        assert chosen.gain() == (1.0, 1.0, 1.0)


def test_looks_spend_the_error_once() -> None:
    """Each look at half of the next, none before fifty episodes; their errors sum to all of it."""
    found = looks(2000, 0.05)
    assert [one.episodes for one in found] == [62, 125, 250, 500, 1000, 2000]
    assert math.fsum(one.error for one in found) == pytest.approx(0.05)
    assert max(found, key=lambda one: one.error) is found[-1]
    assert looks(7, 0.05) == [(7, 0.05)]


def test_ending_early_keeps_the_coverage() -> None:
    """Monte Carlo that ends at a half-width of 0.5: misses at most 5 % of 400 times, about."""
    missed = 0
    for seed in range(400):
        one = played(made("monte-carlo", Goal(1000, 0.5), seed), lambda u: 0.1 - u[:, 0])
        missed += not one.history[-1].lower <= 0.1 <= one.history[-1].upper
        assert one.history[-1].episodes < 1000
    assert missed <= 25


def test_an_estimate_ends_at_a_bound() -> None:
    """No failure: as soon as the upper end is low enough, and not where it is refused."""
    one = played(made("monte-carlo", Goal(4000, 0.3, 0.01), 1), lambda u: -u[:, 0])
    assert one.over == "the upper bound is at most 0.01"
    assert one.history[-1].upper <= 0.01 < one.history[-2].upper


def test_exact_intervals() -> None:
    """Clopper and Pearson by hand: no failure, all failures, and the number for a bound."""
    none = exact_estimate(0, 50, 0.05, 0.95)
    assert (none.lower, none.upper) == (0.0, pytest.approx(1 - 0.025 ** (1 / 50)))
    every = exact_estimate(50, 50, 0.05, 0.95)
    assert (every.lower, every.upper) == (pytest.approx(0.025 ** (1 / 50)), 1.0)
    needed = needed_without_failure(0.001, 0.95)
    assert exact_estimate(0, needed, 0.05, 0.95).upper <= 0.001
    assert exact_estimate(0, needed - 1, 0.05, 0.95).upper > 0.001


def test_the_density_of_kernels_integrates() -> None:
    """Over the cube it is 1, at least the defensive share; draws have it."""
    rng = np.random.default_rng(4)
    vectors = rng.random((300, 3))
    results = [PlayedVector(bool(v[0] < 0.05), -float(v[0])) for v in vectors]
    kernels = learned(vectors, np.ones(300), results)
    density = kernels.density(rng.random((100_000, 3)))
    assert density.mean() == pytest.approx(1.0, abs=0.02)
    assert density.min() >= kernels.defensive
    drawn = kernels.draw(100_000, rng)
    assert ((drawn >= 0.0) & (drawn <= 1.0)).all()
    weights = 1.0 / kernels.density(drawn)
    for at in (0.1, 0.7):
        assert (weights * (drawn[:, 0] < at)).mean() == pytest.approx(at, abs=0.02)
    assert (uniform(3).density(drawn) == 1.0).all()


def test_a_ratio_of_paired_failures() -> None:
    """The interval covers in simulated pairs, and pairs save episodes; few failures are refused."""
    rng, covered = np.random.default_rng(8), 0
    for _ in range(300):
        u = rng.random((2, 1000))
        first = (u[0] < 0.06) | (u[1] < 0.01)
        second = u[0] < 0.035
        found = ratio_of(first.tolist(), second.tolist())
        covered += found.lower <= (1 - 0.94 * 0.99) / 0.035 <= found.upper
        assert found.saved > 1.0
    assert covered >= 276
    assert "too few" in ratio_of([True] * 9, [False] * 9).refused


@pytest.mark.parametrize(
    ("one", "mean"),
    [
        (Normal(distribution="normal", mean=5.7, sd=1.6, low=3.0), 5.8611),
        (LogNormal(distribution="lognormal", median=2.0, sigma=0.5), 2.0 * math.exp(0.125)),
        (Exponential(distribution="exponential", mean=3.0), 3.0),
        (Histogram(distribution="histogram", edges=(0, 1, 4), shares=(0.5, 0.5)), 1.5),
    ],
)
def test_quantiles_have_the_mean_of_their_distribution(
    one: Normal | LogNormal | Exponential | Histogram, mean: float
) -> None:
    """By the midpoints of 20,000 equal parts; they ascend."""
    found = [one.quantile((i + 0.5) / 20_000) for i in range(20_000)]
    assert found == sorted(found)
    assert np.mean(found) == pytest.approx(mean, rel=2e-3)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[speeds]\nmean = 1", "unknown key 'speeds'"),
        ("[attention]\ninattentve = 0.1", "did you mean 'inattentive'?"),
        ("[attention]\ninattentive = 1.2", "attention.inattentive: "),
        ('[speed_mps]\ndistribution = "normal"\nmean = 1\nsd = 0', "speed_mps.normal.sd: "),
        ('[speed_mps]\ndistribution = "cauchy"', "speed_mps: "),
        (
            '[speed_mps]\ndistribution = "histogram"\nedges = [0, 1]\nshares = [0.9]',
            "speed_mps.histogram: shares: expected a sum of 1, got 0.9",
        ),
        (
            '[critical_gap_s]\ndistribution = "normal"\nmean = 1\nsd = 0.1\nlow = 9.0',
            "expected a distribution with mass between 9 and inf",
        ),
        ("[arrivals", "no TOML"),
    ],
)
def test_a_wrong_exposure_is_refused(text: str, said: str, tmp_path: Path) -> None:
    """One sentence that names the file and the key."""
    file = tmp_path / "exposure.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as error:
        read_exposure(file)
    assert str(error.value).startswith(f"exposure {str(file)!r}: ")
    assert said in str(error.value)
    assert str(error.value).count(", got ") <= 1


def test_an_exposure_keeps_the_defaults_that_it_leaves_out(tmp_path: Path) -> None:
    """Table by table and key by key; a distribution is replaced as a whole."""
    file = tmp_path / "exposure.toml"
    file.write_text('[arrivals]\nper_hour = 5\n[speed_mps]\ndistribution = "exponential"\nmean = 1')
    found, default = read_exposure(file), read_exposure()
    assert found.arrivals.per_hour == 5.0
    assert found.arrivals.within_s == default.arrivals.within_s
    assert found.speed_mps == Exponential(distribution="exponential", mean=1.0)
    assert found.attention == default.attention


def _with(**tables: object) -> Exposure:
    return Exposure.model_validate(read_exposure().model_dump() | tables)


def test_a_vector_is_an_encounter(staged: Callable[..., tuple[BatchPlan, Site]]) -> None:
    """Shares of a vector's space are the shares of the exposure."""
    found = encounters_of(staged("pedestrians")[1], PEDESTRIAN, ((0,),), read_exposure())
    assert found.names == ("place", "arrival", "speed", "gap", "attention")
    drawn = np.random.default_rng(1).random((4000, found.dimension))
    walkers = [found.memories(u)[0]["walkers"][0] for u in drawn]
    speeds = [one["programme"][1] for one in walkers]
    assert 0.3 <= min(speeds) <= max(speeds) <= PEDESTRIAN.v_max
    early = [one["accepts"] for one in walkers if one["arrival_s"] < 3.0]
    assert np.mean(early) == pytest.approx(0.073, abs=0.025)  # nobody else accepts so little
    late = [one["accepts"] for one in walkers if one["arrival_s"] > 11.0]
    assert np.mean(late) > 0.99


def test_stops_on_the_road_have_coordinates_of_their_own(
    staged: Callable[..., tuple[BatchPlan, Site]],
) -> None:
    """Everybody stops for two seconds, somewhere."""
    pause = {"distribution": "histogram", "edges": (2.0, 2.0001), "shares": (1.0,)}
    exposure = _with(hesitation={"share": 1.0, "pause_s": pause})
    found = encounters_of(staged("pedestrians")[1], PEDESTRIAN, ((0,),), exposure)
    assert found.names[-2:] == ("hesitates", "where")
    programme = found.memories(np.full(found.dimension, 0.5))[0]["walkers"][0]["programme"]
    assert programme[3:5] == [0.0, pytest.approx(2.0, abs=1e-3)]


def test_an_exposure_without_support_is_refused(
    staged: Callable[..., tuple[BatchPlan, Site]],
) -> None:
    """Speeds that nobody walks, and bodies that do not walk."""
    site = staged("pedestrians")[1]
    fast = _with(speed_mps={"distribution": "normal", "mean": 9.0, "sd": 0.1})
    with pytest.raises(InputError, match=r"speed_mps: .* between 0.3 and 1.4, the speeds of a ped"):
        encounters_of(site, PEDESTRIAN, ((0,),), fast)
    with pytest.raises(InputError, match="only pedestrian, bicycle and car have one"):
        encounters_of(site, BUS, ((0,),), read_exposure())


def test_strata_are_all_of_the_cube() -> None:
    """Two cuts give four strata; half of all vectors is spread over them alike."""
    low, high = bounds(3, (Cut(0, 0.1), Cut(2, 0.4), Cut(1, 0.0)))
    weights = (high - low).prod(1)
    assert sorted(weights) == pytest.approx([0.04, 0.06, 0.36, 0.54])
    counts = allocated(weights, 1000)
    assert counts.sum() == 1000
    assert min(counts) == 125 + 20
    assert max(counts) == 1000 - 145 - 155 - 305


def test_one_stratum_has_the_exact_interval_of_a_count() -> None:
    """Garwood's for 0 and 3 failures of 1000: at most 3.689, and 0.619 to 8.767."""
    one, three = (
        weighted_counts(np.array([n]), np.array([1e-3]), 0.05, 0.95, 1000) for n in (0, 3)
    )
    assert (one.lower, one.upper) == (0.0, pytest.approx(3.6889e-3, rel=1e-4))
    assert three.lower == pytest.approx(0.61867e-3, rel=1e-4)
    assert three.upper == pytest.approx(8.7673e-3, rel=1e-4)


def test_strata_find_failures_of_a_rare_kind() -> None:
    """Failures of one in a hundred: 200 intervals cover, with less spread than by chance."""
    cuts, truth, found = (Cut(0, 0.1), Cut(1, 0.1)), 0.002, []
    for seed in range(200):
        one = Stratified(3, Goal(1000, NEVER), np.random.default_rng(seed), cuts)
        played(one, lambda u: np.where(u[:, :2].max(1) < 0.1, 0.2 - u[:, 2], -1.0))
        found.append(one)
    last = [one.history[-1] for one in found]
    assert np.mean([one.p for one in last]) == pytest.approx(truth, rel=0.05)
    assert sum(one.lower <= truth <= one.upper for one in last) >= 190
    assert np.var([one.p for one in last]) < truth / 1000 / 4
    assert np.median([one.gain()[0] for one in found]) > 4.0
    assert last[0].episodes == 1000


def test_vehicles_come_as_an_exposure_says(
    staged: Callable[..., tuple[BatchPlan, Site]],
) -> None:
    """Bicycles: shares, speeds, and starts on ways that cross the ego's; early ones are nearer."""
    site = staged("crossing", kind="bicycle")[1]
    found = encounters_of(site, BICYCLE, ((0,),), read_exposure())
    assert isinstance(found, VehicleEncounters)
    assert found.names == ("approach", "arrival", "speed", "gap", "attention")
    assert found.per_hour == 30.0
    assert found.cuts == (Cut(4, 0.02),)
    drawn = np.random.default_rng(1).random((2000, found.dimension))
    memories = [found.memories(u)[0] for u in drawn]
    drivers = [one["drivers"][0] for one in memories]
    assert np.mean([one["looks"] for one in drivers]) == pytest.approx(0.98, abs=0.01)
    assert np.mean([one["critical_gap_s"] for one in drivers]) == pytest.approx(6.5, abs=0.15)
    assert max(one["programme"][1] for one in drivers) == BICYCLE.v_max
    assert max(one["arrival_s"] for one in drivers) <= 12.0
    assert {one["starts"][0][4] for one in memories} == {
        i for i, way in enumerate(site.approaches) if math.isfinite(way.wait)
    }
    low, high = (np.full(found.dimension, 0.5) for _ in range(2))
    low[:2], high[:2] = (0.0, 0.1), (0.0, 0.9)
    first, last = (found.memories(u)[0]["starts"][0] for u in (low, high))
    path, place = site.approaches[first[4]].path, lambda start: (start[0], start[1])
    assert path.project(*place(first)).along < path.project(*place(last)).along
