"""Policies, histories and eq. 1 over finite horizons."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from cavsumo.games import (
    GameError,
    History,
    HistoryDependent,
    Markovian,
    Stationary,
    execute,
    expected_value,
    from_transitions,
    histories,
    is_markovian,
    is_pure,
    is_stationary,
    least_reach_probability,
    pure,
    reach_probability,
    uniform,
)
from cavsumo.games.policies import EGO, TESTER

# Pennies: same sides end it, others cost one and go on.
PENNIES = from_transitions(
    2,
    [1],
    [
        (0, 0, 0, [(1, 1, -1)]),
        (0, 0, 1, [(0, 1, -1)]),
        (0, 1, 0, [(0, 1, -1)]),
        (0, 1, 1, [(1, 1, -1)]),
    ],
)
HEADS, TAILS = {0: Fraction(1)}, {1: Fraction(1)}
TURNS = Markovian(lambda _, t: HEADS if t % 2 else TAILS)
MEMORY = HistoryDependent(lambda h: TAILS if h.profiles and h.profiles[-1][1] == 1 else HEADS)


def test_what_a_policy_looks_at() -> None:
    """The predicates of section 2.1, over all histories of a few steps."""
    fair = uniform(PENNIES, TESTER)
    assert [is_pure(PENNIES, p) for p in (fair, pure({0: 1}), TURNS, MEMORY)] == [
        False,
        *[True] * 3,
    ]
    assert [is_markovian(PENNIES, p) for p in (fair, TURNS, MEMORY)] == [True, True, False]
    assert [is_stationary(PENNIES, p) for p in (fair, TURNS, MEMORY)] == [True, False, False]
    constant = HistoryDependent(lambda _: HEADS)
    assert is_markovian(PENNIES, constant)
    assert is_stationary(PENNIES, constant)


def test_histories_hold_one_state_more_than_profiles() -> None:
    """A history of length t has t states; goals end it."""
    found = list(histories(PENNIES, 3, start=0))
    assert len(found) == 2 * 4
    assert {h.step for h in found} == {3}
    assert all(len(h.profiles) == 2 for h in found)
    assert {h.states[:2] for h in found} == {(0, 0)}


@pytest.mark.parametrize("horizon", [0, 1, 2, 5])
def test_expected_value_over_a_finite_horizon(horizon: int) -> None:
    """Against a fair coin a step costs one and ends with probability 1/2, whoever looks at what."""
    coin = uniform(PENNIES, EGO)
    value = -sum((Fraction(1, 2**k) for k in range(horizon)), Fraction(0))
    for tester in (pure({0: 0}), TURNS, MEMORY):
        assert expected_value(PENNIES, tester, coin, horizon, 0) == value
        assert reach_probability(PENNIES, tester, coin, {1}, horizon, 0) == 1 - Fraction(
            1, 2**horizon
        )


def test_memory_beats_an_ego_that_repeats_itself() -> None:
    """Whoever remembers the ego's tails answers them: done in two steps at the latest."""
    tails = pure({0: 1})
    assert expected_value(PENNIES, MEMORY, tails, 9, 0) == -2
    assert expected_value(PENNIES, pure({0: 0}), tails, 9, 0) == -9
    seen = History((0, 0), ((0, 1),))
    assert expected_value(PENNIES, MEMORY, tails, 9, seen) == -1
    assert reach_probability(PENNIES, MEMORY, tails, {1}, 1, seen) == 1


def test_the_worst_ego_within_t() -> None:
    """Eq. 2: no pure policy gets there at all, the fair mixture with 1 - 2^-t."""
    assert least_reach_probability(PENNIES, TURNS, 4, 0) == 0
    assert least_reach_probability(PENNIES, MEMORY, 4, 0) == 0
    fair = uniform(PENNIES, TESTER)
    assert least_reach_probability(PENNIES, fair, 4, 0) == Fraction(15, 16)
    hidden = HistoryDependent(fair.strategy)  # the same, history by history
    assert least_reach_probability(PENNIES, hidden, 4, 0) == Fraction(15, 16)


def test_executions_follow_the_policies() -> None:
    """The same generator plays the same; the mean return is the value."""
    fair, coin = uniform(PENNIES, TESTER), uniform(PENNIES, EGO)
    one = execute(PENNIES, fair, coin, np.random.default_rng(3), start=0)
    assert one == execute(PENNIES, fair, coin, np.random.default_rng(3), start=0)
    assert one.history.state == 1
    assert len(one.rewards) == len(one.history.profiles)
    rng = np.random.default_rng(5)
    mean = np.mean([sum(execute(PENNIES, fair, coin, rng, start=0).rewards) for _ in range(2000)])
    assert mean == pytest.approx(-2, abs=0.15)


def test_a_strategy_that_is_none_is_refused() -> None:
    """Unknown actions and weights that do not sum to 1."""
    coin = uniform(PENNIES, EGO)
    with pytest.raises(GameError, match="tester's strategy plays 7"):
        expected_value(PENNIES, pure({0: 7}), coin, 1, 0)
    half = Stationary({0: {0: Fraction(1, 2)}})
    with pytest.raises(GameError, match="is no distribution"):
        expected_value(PENNIES, half, coin, 1, 0)
