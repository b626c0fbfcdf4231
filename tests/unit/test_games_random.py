"""Random games: brute force over all policies, an independent solver, and the order of readings."""

from __future__ import annotations

import itertools
import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from support import benchmark

from cavsumo.games import (
    Game,
    Reading,
    from_transitions,
    holds_exactly,
    policies,
    proper_states,
    pure,
    solvability,
    solve,
    stationary_values,
)
from cavsumo.games.build import from_arrays
from cavsumo.games.matrix_games import solve as solve_matrices


@st.composite
def games(draw: st.DrawFn, highest: int = 1) -> Game:
    """Games of up to three states and a goal, two actions each, rewards of both signs."""
    live = draw(st.integers(1, 3))
    transitions = []
    for state in range(live):
        many, wide = draw(st.integers(1, 2)), draw(st.integers(1, 2))
        for a1, a2 in itertools.product(range(many), range(wide)):
            weights = draw(st.lists(st.integers(0, 3), min_size=live + 1, max_size=live + 1))
            weights[-1] += not any(weights)
            reward = draw(st.integers(-6, highest))
            outcomes = [(s, Fraction(w, sum(weights)), reward) for s, w in enumerate(weights)]
            transitions.append((state, a1, a2, outcomes))
    return from_transitions(live + 1, [live], transitions)


def by_brute_force(game: Game, reading: Reading) -> list[Fraction | float]:
    """max min (A) or min max (C) over all pure stationary profiles, evaluated exactly."""
    live = np.flatnonzero(~game.goal).tolist()
    choices = {
        Reading.A: [policies.tester_actions(game, s) for s in live],
        Reading.C: [policies.ego_actions(game, s) for s in live],
    }
    first, second = choices[reading], choices[Reading.C if reading is Reading.A else Reading.A]
    inner, outer = (min, max) if reading is Reading.A else (max, min)
    best: list[Any] = []
    for lead in itertools.product(*first):
        replies = []
        for reply in itertools.product(*second):
            tester, ego = (lead, reply) if reading is Reading.A else (reply, lead)
            pair = (pure(dict(zip(live, part, strict=True))) for part in (tester, ego))
            found = stationary_values(game, *pair, exact=True)
            assert None not in found
            assert math.inf not in found
            replies.append(found)
        best.append([inner(values) for values in zip(*replies, strict=True)])
    return [outer(values) for values in zip(*best, strict=True)]


@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
@given(games(), st.sampled_from([Reading.A, Reading.C]))
def test_bounds_enclose_what_enumeration_finds(game: Game, reading: Reading) -> None:
    """Every pure stationary profile is evaluated in rationals; the bounds hold in rationals."""
    assume(solvability(game, reading).solvable)
    found = solve(game, reading)
    exact = by_brute_force(game, reading)
    for low, value, high in zip(found.lower, exact, found.upper, strict=True):
        assert Fraction(float(low)) <= value <= Fraction(float(high))
    assert found.precise
    assert holds_exactly(game, found.certificate)


@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
@given(games())
def test_who_commits_first_fares_no_better(game: Game) -> None:
    """V_A <= V_B <= V_C; what is solvable in A is so in B, in B so in C; the test is proper."""
    verdicts = [solvability(game, reading).solvable for reading in Reading]
    assert verdicts == sorted(verdicts)
    assume(verdicts[1])
    found = [solve(game, reading) for reading, yes in zip(Reading, verdicts, strict=True) if yes]
    for lesser, greater in itertools.pairwise(found):
        assert (lesser.lower <= greater.upper).all()
    for one in found:
        assert holds_exactly(game, one.certificate)
    if verdicts[0]:
        weights = found[0].certificate.tester
        rows = [r for r in range(game.n_rows) if weights[game.cell_start[r]] > 0]
        test = pure({int(game.row_state[r]): int(game.tester_action[r]) for r in rows})
        assert all(proper_states(game, test))


@settings(max_examples=40, deadline=None)
@given(
    st.integers(1, 4).flatmap(
        lambda wide: st.lists(
            st.lists(st.integers(-9, 9), min_size=wide, max_size=wide), min_size=1, max_size=4
        )
    )
)
def test_a_matrix_game_is_solved(matrix: list[list[int]]) -> None:
    """What the rows guarantee is what the columns guarantee."""
    m = np.array([matrix], dtype=float)
    found = solve_matrices(m)
    assert (found.rows[0] @ m[0]).min() == pytest.approx(found.value[0], abs=1e-8)
    assert (m[0] @ found.columns[0]).max() == pytest.approx(found.value[0], abs=1e-8)
    assert found.rows[0].sum() == pytest.approx(1)
    assert found.columns[0].sum() == pytest.approx(1)


def random_game(rng: np.random.Generator, states: int, many: int, wide: int) -> Game:
    """A random game in which every step costs something and may end it."""
    cells, outcomes = (states - 1) * many * wide, 4
    successor = rng.integers(0, states, (cells, outcomes))
    successor[:, 0] = np.where(rng.random(cells) < 0.2, states - 1, successor[:, 0])
    successor[::3, 1] = states - 1
    weights = rng.random((cells, outcomes)) + 0.05
    goal = np.arange(states) == states - 1
    return from_arrays(
        goal,
        np.minimum(np.arange(states + 1), states - 1) * many,
        np.arange((states - 1) * many + 1) * wide,
        np.arange(cells + 1) * outcomes,
        successor.ravel(),
        (weights / weights.sum(axis=1, keepdims=True)).ravel(),
        -rng.integers(1, 20, cells).astype(float),
    )


def storm() -> Any:
    """The benchmark's bridge to Storm, where it is installed."""
    pytest.importorskip("stormpy")
    return benchmark("storm")


@pytest.mark.parametrize("seed", range(4))
def test_storm_agrees_on_random_mdps(seed: int) -> None:
    """Against an ego without choice the game is an MDP, which Storm solves by itself."""
    game = random_game(np.random.default_rng(seed), 200 + 700 * (seed % 2), 3, 1)
    found = solve(game)
    cost = storm().expected_cost(game, np.arange(game.n_cells), least=True)
    assert (found.lower <= -cost + 1e-6).all()
    assert (-cost - 1e-6 <= found.upper).all()


@pytest.mark.parametrize("reading", [Reading.A, Reading.C])
@pytest.mark.parametrize("seed", range(3))
def test_storm_agrees_on_random_games(seed: int, reading: Reading) -> None:
    """With a policy of the certificate fixed the game is an MDP, which has the game's value."""
    bridge = storm()
    game = random_game(np.random.default_rng(100 + seed), 300, 2, 3)
    found = solve(game, reading)
    for weights, least in ((found.certificate.tester, False), (found.certificate.ego, True)):
        if (reading is Reading.A) == least:
            continue  # the one who answers plays in every row: fixed below with the other
        cost = bridge.expected_cost(game, np.flatnonzero(weights > 0), least=least)
        assert (found.lower <= -cost + 2e-6).all()
        assert (-cost - 2e-6 <= found.upper).all()
    answers = found.certificate.ego if reading is Reading.A else found.certificate.tester
    cost = bridge.expected_cost(game, np.flatnonzero(answers > 0), least=reading is Reading.A)
    assert (found.lower <= -cost + 2e-6).all()
    assert (-cost - 2e-6 <= found.upper).all()


def test_many_states_are_solved_by_the_iterative_path() -> None:
    """Beyond the size of direct solutions: ordering, BiCGSTAB, certificate."""
    game = random_game(np.random.default_rng(7), 6000, 2, 2)
    found = solve(game)
    assert found.precise
    assert found.lower.max() == 0.0
    assert (found.upper[:-1] < 0).all()


def test_bounds_are_close_where_floats_are_coarse() -> None:
    """2,000 steps and a value of -100,000: a residual of 20 units of its last place is too much.

    Near the end a slip now and then leads back to the beginning.
    """
    states, slips = 2000, range(1900, 2000, 10)
    transitions: list[Any] = []
    for k in range(states - 1):
        slip = [(k + 1, "99/100", -50), (0, "1/100", -50)]
        transitions.append((k, 0, 0, slip if k in slips else [(k + 1, 1, -50)]))
    game = from_transitions(states, [states - 1], transitions)
    found = solve(game)
    assert found.upper[0] < -1e5
    assert found.precise
    assert holds_exactly(game, found.certificate)


def test_a_first_policy_may_be_terrible() -> None:
    """A ladder on which every slip leads back: 2^-k on the obvious way up, a safe way beside it."""
    rungs = 40
    transitions: list[Any] = []
    for k in range(rungs):
        transitions.append((k, 0, 0, [(k + 1, "1/2", -1), (0, "1/2", -1)]))
        transitions.append((k, 1, 0, [(k + 1, 1, -3)]))
    game = from_transitions(rungs + 1, [rungs], transitions)
    found = solve(game)
    assert found.precise
    assert holds_exactly(game, found.certificate)
    assert found.lower[rungs - 1] == pytest.approx(-3.0, abs=1e-6)
