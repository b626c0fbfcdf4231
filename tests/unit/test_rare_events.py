"""The learned twist on the surrogate with exact truth, its values, and the trees it learns by."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
import pytest
from support import DATA

from cavsumo.games import from_transitions
from cavsumo.games.horizon import horizon_values
from cavsumo.probability.surrogate import Following, exact_probability
from cavsumo.probability.tree import grown
from cavsumo.probability.twist import (
    Component,
    Runs,
    estimate_by_twist,
    explored,
    learned_values,
    twisted,
)
from cavsumo.probability.weights import contradicts, weighted

VECTORS = json.loads((DATA / "rare_event_surrogate.json").read_text("utf-8"))


@pytest.mark.parametrize("p3", VECTORS["exact"])
def test_the_surrogate_has_the_published_probabilities(p3: str) -> None:
    """Forward dynamic programming, at every p3 of the vectors."""
    truth = float(VECTORS["exact"][p3])
    assert exact_probability(Following(p3=float(p3))) == pytest.approx(truth, rel=1e-11)


def test_values_of_the_true_responses_are_the_probability() -> None:
    """Backward induction over the game agrees with the forward sums."""
    process = Following(p3=0.02)
    states = np.arange(process.states - 1)
    responses = process.respond(states, np.random.default_rng(1))
    values = learned_values(process, [Runs(np.zeros(1), states, responses)])
    first = values.table[process.horizon, process.first]
    assert first == pytest.approx(exact_probability(process), rel=0.01)  # a little is left unseen


def test_values_of_a_finite_horizon() -> None:
    """Paid by hand: the tester takes the larger of what the ego leaves of each action."""
    moves = [
        (0, 0, 0, [(0, 1, 1)]),
        (0, 0, 1, [(1, 1, 5)]),
        (0, 1, 0, [(1, "1/2", 4), (0, "1/2", 0)]),
    ]
    values = horizon_values(from_transitions(2, [1], moves), 3)
    assert values[:, 0].tolist() == [0.0, 2.0, 3.0, 4.0]
    assert not values[:, 1].any()


@pytest.mark.parametrize(
    ("process", "within"),
    [(Following(p3=0.003), 0.1), (Following(p3=0.001), 0.1), (Following(closing=1, hard=1), 0.1)],
)
def test_rare_failures_are_estimated(process: Following, within: float) -> None:
    """Ten estimates of 1,800 runs: the mean is the truth, and at most one interval misses it."""
    truth = exact_probability(process)
    found = [estimate_by_twist(process, np.random.default_rng(seed)).estimate for seed in range(10)]
    assert np.mean([one.p for one in found]) == pytest.approx(truth, rel=within)
    assert sum(one.lower <= truth <= one.upper for one in found) >= 9
    assert not any(one.refused for one in found)


def test_a_wrong_model_leaves_the_estimate_unbiased() -> None:
    """With values of an ego that never brakes the weights still sum to the truth."""
    process, rng = Following(p3=0.02), np.random.default_rng(5)
    states = np.arange(process.states - 1)
    values = learned_values(process, [Runs(np.zeros(1), states, np.zeros(len(states), dtype=int))])
    terms = twisted(process, values, 40_000, rng).terms
    error = terms.std() / len(terms) ** 0.5
    assert abs(terms.mean() - exact_probability(process)) < 4 * error


def test_tilted_runs_are_weighed_exactly() -> None:
    """The exploration by itself is an estimate, too."""
    process = Following(p3=0.05, gap=4, horizon=6)
    terms = explored(process, 40_000, np.random.default_rng(3)).terms
    assert abs(terms.mean() - exact_probability(process)) < 4 * terms.std() / len(terms) ** 0.5


@dataclass(frozen=True)
class Moody(Following):
    """An ego that responds by chance."""

    def respond(self, states: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        firm = super().respond(states, rng)
        return np.where(rng.random(len(states)) < 0.2, np.minimum(firm + 1, 1), firm)


def test_an_ego_that_responds_by_chance() -> None:
    """Its probability is that of plain Monte Carlo."""
    process = Moody(p3=0.02)
    found = estimate_by_twist(process, np.random.default_rng(2)).estimate
    values = learned_values(process, [explored(process, 200, np.random.default_rng(1))])
    untwisted = (Component(1.0, 0.0, 1.0),)
    plain = twisted(process, values, 40_000, np.random.default_rng(4), untwisted).terms
    assert set(plain) == {0.0, 1.0}
    assert found.lower <= plain.mean() <= found.upper


def test_a_tree_finds_the_steps_of_a_function() -> None:
    """Two thresholds, in the order in which they explain most; each leaf has one value."""
    x = np.random.default_rng(7).random((400, 3))
    y = 10.0 * (x[:, 1] > 0.3) + (x[:, 1] > 0.3) * (x[:, 2] > 0.6)
    tree = grown(x, y, leaves=8, least=5)
    assert len(tree.leaves) == 3
    for leaf in tree.leaves:
        assert np.ptp(y[tree.leaf(x) == leaf]) == 0.0


def test_weights_that_rest_on_one_episode_are_refused() -> None:
    """And so are failures that are worth few; a contradiction is a gap between the intervals."""
    rng = np.random.default_rng(1)
    good = np.where(rng.random(1000) < 0.5, 2e-3 * rng.random(1000), 0.0)
    assert not weighted(good).refused
    assert weighted(np.append(good, 1.0)).refused == "one episode carries 66% of the sum"
    few = np.zeros(1000)
    few[:15] = 1e-3
    assert weighted(few).refused == "the weights are worth only 15.0 failures"
    assert weighted(np.zeros(5)).refused == "no failure was drawn"
    assert contradicts(weighted(good), weighted(good * 2))
    assert not contradicts(weighted(good), weighted(good * 1.01))
