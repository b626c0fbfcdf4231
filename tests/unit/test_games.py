"""SSP games: the vectors in every reading, exact certificates, eq. 1 and eq. 2, bad input."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import DATA, benchmark

from cavsumo.games import (
    Game,
    GameError,
    Reading,
    Stationary,
    Unsolvable,
    almost_sure_region,
    compiled,
    from_callable,
    from_transitions,
    holds,
    holds_exactly,
    literally_solvable,
    proper_states,
    pure,
    read_game,
    solvability,
    solve,
    stationary_values,
    sure_region,
    sure_steps,
    uniform,
)
from cavsumo.games.components import end_components, gain
from cavsumo.games.files import game_of
from cavsumo.games.policies import EGO, ego_actions
from cavsumo.games.rounding import advantages_of, noise_of

VECTORS = json.loads((DATA / "ssp_games.json").read_text(encoding="utf-8"))
CASES = {case["id"]: case for case in VECTORS["cases"]}
LISTED = [name for name, case in CASES.items() if "transitions" in case]
READINGS = list(Reading)


@pytest.fixture(scope="module")
def ring() -> Game:
    """The vector with 1,800 states."""
    return benchmark("rings").two_pedestrians(24, 7)


def numbers(values: list[str]) -> list[float]:
    """Rationals and infinities as floats."""
    return [float(Fraction(v)) if "inf" not in v else float(v) for v in values]


@pytest.mark.parametrize("name", LISTED)
@pytest.mark.parametrize("reading", READINGS)
def test_a_vector_is_solved_or_refused(name: str, reading: Reading) -> None:
    """Bounds within 1e-6 enclose the known value and hold in rationals; the rest is refused."""
    game, expected = game_of(CASES[name]), CASES[name]["expect"]
    known = expected.get(f"V_{reading}")
    if known is None:
        with pytest.raises(Unsolvable, match="state"):
            solve(game, reading)
        return
    found = solve(game, reading)
    digits = 1e-10 if reading is not Reading.A else 0.0  # of the decimals in the file
    for low, value, high in zip(found.lower, numbers(known), found.upper, strict=True):
        assert low - digits * abs(value) <= value <= high + digits * abs(value)
    assert found.width <= 1e-6
    assert holds(game, found.certificate)
    assert holds_exactly(game, found.certificate)


@pytest.mark.parametrize("name", LISTED)
def test_regions_and_solvability_of_a_vector(name: str) -> None:
    """Sure steps, almost-sure regions, gains of end components, solvability in both senses."""
    game, expected = game_of(CASES[name]), CASES[name]["expect"]
    sure = sure_region(game)
    steps = {str(s): int(t) for s, t in enumerate(sure.layer) if t >= 0}
    assert steps == expected["sure_region"]
    for reading in READINGS:
        region = almost_sure_region(game, reading)
        assert np.flatnonzero(region.inside).tolist() == expected[f"almost_sure_region_{reading}"]
    for reading in (Reading.A, Reading.B):
        verdict = solvability(game, reading)
        assert verdict.solvable == expected["solvable"][f"{reading}_strong"]
        assert bool(verdict.reason(game)) != verdict.solvable
        assert verdict.proper.inside.all() == expected["proper_policy_exists"][reading]
    literal = expected["proper_policy_exists"]["A_literal_eq2"]
    assert sure.inside.all() == literal
    found = [(c.states.tolist(), gain(game, c).value) for c in end_components(game)]
    assert [states for states, _ in found] == [s for s, _ in expected["end_components_max_gain"]]
    for (_, value), (_, known) in zip(found, expected["end_components_max_gain"], strict=True):
        assert value == pytest.approx(known, abs=1e-8)
    assert literally_solvable(game, literal=False) == expected["solvable"]["A_seed_min_over_pi2"]
    if literally_solvable(game):
        assert literal
        assert expected["solvable"]["A_seed_min_over_pi2"]


@pytest.mark.parametrize("name", LISTED)
def test_optimal_actions_and_mixtures_of_a_vector(name: str) -> None:
    """The tester's action is one of the optimal ones; unique mixtures are found."""
    game, expected = game_of(CASES[name]), CASES[name]["expect"]
    if expected.get("V_A"):
        weights = solve(game).certificate.tester
        for state, actions in expected["optimal_actions_A"].items():
            played = [r for r in game.rows(int(state)) if weights[game.cell_start[r]] == 1.0]
            assert len(played) == 1
            assert game.tester_action[played[0]] in actions
    if name in ("matching_pennies", "sqrt2", "rock_paper_scissors"):
        weights = solve(game, "B").certificate.tester
        mixed = [weights[game.cell_start[r]] for r in game.rows(0)]
        assert mixed == pytest.approx(expected["mixed_strategies_B"]["0"]["tester"], abs=1e-6)


@pytest.mark.parametrize("name", LISTED)
def test_policies_of_a_vector(name: str) -> None:
    """Eq. 1 over an infinite horizon, exactly and in floats, and eq. 2 in both readings."""
    game = game_of(CASES[name])
    live = np.flatnonzero(~game.goal).tolist()
    egos = {
        "ego_first_action": pure({s: ego_actions(game, s)[0] for s in live}),
        "ego_last_action": pure({s: ego_actions(game, s)[-1] for s in live}),
        "ego_uniform": uniform(game, EGO),
    }
    for policy in CASES[name]["expect"]["policies"]:
        tester = Stationary(
            {
                int(s): {int(a): Fraction(p) for a, p in strategy.items()}
                for s, strategy in policy["tester"].items()
            }
        )
        proper = proper_states(game, tester)
        assert [s for s, yes in enumerate(proper) if yes] == policy["proper_states_almost_sure"]
        steps = sure_steps(game, tester)
        literal = [s for s, t in enumerate(steps) if t is not None]
        assert literal == policy["proper_states_literal_eq2"]
        for known in policy["values"]:
            exact = stationary_values(game, tester, egos[known["ego"]], exact=True)
            assert ["undef" if v is None else str(v) for v in exact] == known["V"]
            rounded = stationary_values(game, tester, egos[known["ego"]])
            assert [v is None for v in rounded] == [v is None for v in exact]
            assert [v for v in rounded if v is not None] == pytest.approx(
                [float(v) for v in exact if v is not None]
            )


def test_the_ring_of_the_vectors(ring: Game) -> None:
    """The game given by rule: its states, regions, and the bounds at every probe."""
    expected = CASES["ped_car_ring_24"]["expect"]
    assert (ring.n_states, ring.goal.sum(), ring.initial) == (1800, 60, 925)
    found = solve(ring)
    assert found.verdict.solvable
    assert found.verdict.sure.inside.sum() == expected["sure_region_size"]
    for state, value in expected["V_A_probe"].items():
        assert found.lower[int(state)] - 1e-9 <= float(value) <= found.upper[int(state)] + 1e-9
    assert found.lower.sum() <= float(expected["V_A_sum"]) <= found.upper.sum()
    assert found.lower[expected["argmin"]] == pytest.approx(found.lower.min(), abs=1e-6)
    assert found.width <= 1e-6
    optimistic = solve(ring, "C")
    assert optimistic.lower[925] == pytest.approx(float(expected["V_C_initial"]), abs=1e-6)
    assert (found.lower <= optimistic.upper).all()


def test_the_ring_is_the_one_of_the_rules(ring: Game) -> None:
    """A cell worked out by hand: x = 12, v = 2, both step forward, the car accelerates."""
    cell = ring.cells(ring.rows(925)[8])[2]
    likely = max(ring.outcomes(cell), key=lambda outcome: outcome[1])
    assert likely[:2] == (((14 * 3 + 2) * 5 + 1) * 5 + 1, pytest.approx(0.9 * 0.9 * 0.8))


def test_the_compiled_loops_are_the_same(ring: Game, monkeypatch: pytest.MonkeyPatch) -> None:
    """With numba and without: the same regions, moves and all, and bounds that agree."""
    pytest.importorskip("numba")
    for reading in (Reading.A, Reading.C):
        monkeypatch.setattr(compiled, "COMPILED", 0)
        fast = solve(ring, reading)
        monkeypatch.setattr(compiled, "COMPILED", math.inf)
        plain = solve(ring, reading)
        for name in ("proper", "sure"):
            one, other = (getattr(found.verdict, name) for found in (fast, plain))
            assert (one.layer == other.layer).all()
            assert (one.moves == other.moves).all()
        assert holds(ring, fast.certificate)
        assert fast.lower == pytest.approx(plain.lower, abs=1e-6)


def test_errors_of_advantages_are_bounded() -> None:
    """The advantage of every cell, in rationals, is within the bound on the rounding error."""
    game, rng = game_of(CASES["risky_or_safe"]), np.random.default_rng(0)
    assert game.exact is not None
    value = np.where(game.goal, 0.0, rng.normal(0, 1e6, game.n_states))
    advantage, error = advantages_of(game, value, np.arange(game.n_cells))
    for cell in range(game.n_cells):
        state, numbers = int(game.cell_state[cell]), game.exact.probability
        span = range(int(game.outcome_start[cell]), int(game.outcome_start[cell + 1]))
        mean = sum(numbers[k] * Fraction(value[game.successor[k]]) for k in span)
        exact = game.exact.reward[cell] + mean - Fraction(value[state])
        assert abs(exact - Fraction(advantage[cell])) <= Fraction(error[cell])


def test_advantages_of_some_cells_are_those_of_all(
    ring: Game, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To the last bit, with numba and without; the noise of a state is its largest error."""
    pytest.importorskip("numba")
    value = np.where(ring.goal, 0.0, -np.random.default_rng(0).random(ring.n_states))
    some, every = np.arange(5, ring.n_cells, 7), np.arange(ring.n_cells)
    found = []
    for least in (0, math.inf):
        monkeypatch.setattr(compiled, "COMPILED", least)
        advantage, error = advantages_of(ring, value, every)
        for part, whole in zip(advantages_of(ring, value, some), (advantage, error), strict=True):
            assert (part == whole[some]).all()
        noise = noise_of(ring, value, np.inf, 1e-3)
        most = np.zeros(ring.n_states)
        np.maximum.at(most, ring.cell_state, 4.0 * error + 1e-3)
        assert (noise == most).all()
        errors = np.concatenate([error, noise, noise_of(ring, value, 0.1, 0.0)])
        found.append((advantage, errors))
    (fast, errors_fast), (plain, errors_plain) = found  # whose orders of sums differ
    assert fast == pytest.approx(plain, rel=0, abs=1e-12)
    assert errors_fast == pytest.approx(errors_plain, rel=1e-9, abs=0)


def test_an_unsolvable_game_names_its_trap() -> None:
    """The message has the states in which the ego can hold the play, and the verdict all lost."""
    game = game_of(CASES["ego_blocks"])
    with pytest.raises(Unsolvable, match="in states 0, 1 the ego can keep the play") as caught:
        solve(game)
    trap = caught.value.verdict.trap
    assert trap is not None
    assert trap.states.tolist() == [0, 1]
    with pytest.raises(Unsolvable, match="in state 0 a play can go on for ever that costs nothing"):
        solve(game_of(CASES["free_waiting"]), trim=True)


def test_what_can_be_solved_is_solved_on_request() -> None:
    """With trim, states from which no goal can be forced get -inf and are kept away from."""
    game = from_transitions(
        4,
        [3],
        [
            (0, 0, 0, [(1, 1, -1)]),
            (0, 1, 0, [(3, "1/2", -5), (0, "1/2", -5)]),
            (1, 0, 0, [(1, 1, -1)]),
            (1, 0, 1, [(3, 1, -1)]),
            (2, 0, 0, [(0, 1, -1)]),
        ],
    )
    for reading in (Reading.A, Reading.C):
        with pytest.raises(Unsolvable):
            solve(game, reading)
    for reading in READINGS:
        found = solve(game, reading, trim=True)
        assert found.lower == pytest.approx([-10, -math.inf, -11, 0], abs=1e-6)
        assert holds_exactly(game, found.certificate)


def test_a_cycle_without_cost_is_found_among_rewards_of_both_signs() -> None:
    """Gains decide, not signs: +1, -1 has gain 0 and eq. 1 no value there; +1, -2 is solvable."""
    for back, solvable in ((-1, False), (-2, True)):
        game = from_transitions(
            3,
            [2],
            [
                (0, 0, 0, [(1, 1, 1)]),
                (0, 1, 0, [(2, 1, -4)]),
                (1, 0, 0, [(0, 1, back)]),
            ],
        )
        assert solvability(game).solvable == solvable
        round_ = stationary_values(game, pure({0: 0, 1: 0}), uniform(game, EGO), exact=True)
        assert round_ == ([None, None, 0] if not solvable else [-math.inf, -math.inf, 0])
        assert literally_solvable(game) == solvable
    assert solve(game).lower == pytest.approx([-4, -6, 0], abs=1e-6)


def test_literally_solvable_takes_proper_to_the_letter() -> None:
    """Half back, half on: the only policy reaches the goal almost surely, within no time."""
    half = from_transitions(2, [1], [(0, 0, 0, [(0, "1/2", "-1"), (1, "1/2", "-1")])])
    assert literally_solvable(half) is False
    assert literally_solvable(half, literal=False) is True
    straight = (0, 1, 0, [(1, 1, -3)])
    both = from_transitions(2, [1], [(0, 0, 0, [(0, "1/2", "-1"), (1, "1/2", "-1")]), straight])
    assert literally_solvable(both) is False  # an improper policy earns -2
    stays = from_transitions(2, [1], [(0, 0, 0, [(0, 1, -1)]), straight])
    assert literally_solvable(stays) is True  # an improper policy earns minus infinity


def test_a_limit_that_is_never_taken_is_refused() -> None:
    """Hide or run: the goal can be forced with any probability below 1 but not 1, so: no."""
    game = from_transitions(
        3,
        [1],
        [
            (0, 0, 0, [(0, 1, -1)]),
            (0, 0, 1, [(1, 1, -1)]),
            (0, 1, 0, [(1, 1, -1)]),
            (0, 1, 1, [(2, 1, -1)]),
            (2, 0, 0, [(2, 1, -1)]),
            (2, 0, 1, [(2, 1, -1)]),
        ],
    )
    verdict = solvability(game, Reading.B)
    assert verdict.trap is not None
    assert verdict.trap.lost.tolist() == [0, 2]
    assert "from state 0 the tester cannot exclude getting there" in verdict.reason(game)


def test_positive_rewards_are_no_trouble() -> None:
    """Rewards of both signs, a value above 0: value iteration from 0 would come from below."""
    game = from_transitions(
        3,
        [2],
        [
            (0, 0, 0, [(1, "1/2", 7), (0, "1/2", "-1/2")]),
            (1, 0, 0, [(2, 1, 3)]),
            (1, 0, 1, [(0, "1/4", -9), (2, "3/4", 8)]),
        ],
    )
    found = solve(game)
    assert found.lower == pytest.approx([9.5, 3.0, 0.0], abs=1e-6)
    assert holds_exactly(game, found.certificate)


def test_a_game_from_a_function() -> None:
    """States are found by exploring; they keep their names."""
    game = from_callable(
        ("walk", 0),
        lambda s: ((1, 2), ("wait",)),
        lambda s, a, _: [(("walk", min(3, s[1] + a)), "9/10", -a), (s, "1/10", -a)],
        lambda s: s[1] == 3,
    )
    assert game.labels is not None
    assert set(game.labels) == {("walk", x) for x in range(4)}
    assert solve(game).lower[0] == pytest.approx(-10 / 3, abs=1e-6)


def test_weights_that_are_no_policies_are_refused_by_the_compiled_loop_too(
    ring: Game, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each cell of either policy in turn at several wrong weights, and at its own."""
    import dataclasses

    pytest.importorskip("numba")
    found = solve(ring).certificate
    for whose in ("tester", "ego"):
        weights_tried = (0.0, 1.0, -1.0, 0.5, math.nan)
        for cell, weight in itertools.product(range(0, ring.n_cells, 501), weights_tried):
            weights = getattr(found, whose).copy()
            weights[cell] = weight
            wrong = dataclasses.replace(found, **{whose: weights})
            answers = []
            for least in (0, math.inf):
                monkeypatch.setattr(compiled, "COMPILED", least)
                answers.append(holds(ring, wrong))
            assert answers[0] == answers[1]
            assert not (weight in (-1.0, 0.5) and answers[0])


@pytest.mark.parametrize("fast", [False, True])
def test_a_wrong_certificate_does_not_hold(
    ring: Game, fast: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The check refuses bounds that are too tight, in one state too, and policies that are none."""
    import dataclasses

    if fast:
        pytest.importorskip("numba")
    monkeypatch.setattr(compiled, "COMPILED", 0 if fast else math.inf)
    found = solve(ring).certificate
    assert holds(ring, found)
    middle = (found.lower + found.upper) / 2
    raised = np.where(ring.goal, 0.0, middle + 1e-3)
    lowered = np.where(ring.goal, 0.0, middle - 1e-3)
    assert not holds(ring, dataclasses.replace(found, lower=raised))
    assert not holds(ring, dataclasses.replace(found, upper=lowered))
    there = np.arange(ring.n_states) == ring.initial
    for bound, moved in (("lower", raised), ("upper", lowered)):
        wrong: Any = {bound: np.where(there, moved, getattr(found, bound))}
        assert not holds(ring, dataclasses.replace(found, **wrong))
    assert not holds(ring, dataclasses.replace(found, tester=np.zeros(ring.n_cells)))
    assert not holds(ring, dataclasses.replace(found, ego=found.ego * 0.5))
    with pytest.raises(GameError, match="rationals"):
        holds_exactly(ring, found)


GOOD: dict[str, Any] = {
    "id": "x",
    "n_states": 2,
    "goal": [1],
    "initial": 0,
    "transitions": [[0, 0, 0, [[1, "1/2", -1], [0, 0.5, -1]]]],
}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"goal": []}, "state 1: expected at least one action"),
        ({"goal": [2]}, "goal: expected states below 2, got 2"),
        ({"goal": "1"}, "goal: expected a list"),
        ({"initial": 5}, "initial: expected a state below 2"),
        ({"initial": None}, "initial: expected a whole number, got null"),
        ({"n_states": 0}, "n_states: expected at least 1"),
        ({"n_states": True}, "n_states: expected a whole number, got true"),
        ({"n_states": 3}, "state 2: expected at least one action"),
        ({"n_states": 10**12}, "state 2: expected at least one action"),
        ({"transitions": []}, "state 0: expected at least one action"),
        ({"transitions": {}}, "transitions: expected a list"),
        ({"transitions": [[0, 0, 0]]}, r"transitions\[0\]: expected \[state"),
        (
            {"transitions": [[0, 0, 0, [[1, 1]]]]},
            r"transitions\[0\] \(state 0\): expected outcomes",
        ),
        ({"transitions": [[0, 0, 0, []]]}, "state 0.*sum to 1, got 0"),
        ({"transitions": [[0, 0, 0, [[1, "1/3", -1]]]]}, "state 0.*sum to 1, got 0.333"),
        ({"transitions": [[0, 0, 0, [[1, "x", -1]]]]}, "state 0.*expected a probability such as"),
        ({"transitions": [[0, 0, 0, [[1, "1/0", -1]]]]}, "state 0.*expected a probability such as"),
        ({"transitions": [[0, 0, 0, [[1, 1, "1e999"]]]]}, "expected a reward such as"),
        ({"transitions": [[0, 0, 0, [[1, 1, [1]]]]]}, "state 0.*expected a reward such as"),
        ({"transitions": [[0, 0, 0, [[1, 2, 0], [0, -1, 0]]]]}, "at least 0, got -1"),
        ({"transitions": [[0, 0, 0, [[7, 1, 0]]]]}, "expected successors below 2, got 7"),
        ({"transitions": [[9, 0, 0, [[1, 1, 0]]]]}, "expected a state below 2"),
        ({"transitions": [[0, 0, 0, [[1, 1, 0]]]] * 2}, "ego action 0: given twice"),
        (
            {"transitions": [*GOOD["transitions"], [1, 0, 0, [[0, 1, 0]]]]},
            "state 1.*absorbing with reward 0",
        ),
    ],
)
def test_a_bad_file_gets_one_sentence(change: dict[str, Any], said: str, tmp_path: Path) -> None:
    """With the file, the key or state, and what was expected."""
    file = tmp_path / "game.json"
    file.write_text(json.dumps(GOOD), encoding="utf-8")
    assert solve(read_game(file)).lower == pytest.approx([-2, 0], abs=1e-6)
    file.write_text(json.dumps(GOOD | change), encoding="utf-8")
    with pytest.raises(GameError, match=said) as caught:
        read_game(file)
    assert str(caught.value).startswith(f"game {str(file)!r}: ")
    assert "\n" not in str(caught.value)


def test_the_file_of_all_vectors_is_no_game() -> None:
    """Somebody will try; the message says what to do."""
    with pytest.raises(GameError, match="a file holds one of the cases"):
        game_of(VECTORS)


def test_the_ego_must_have_its_actions_everywhere_in_b_and_c() -> None:
    """A is a product; where it is none, only an ego that sees the tester's move makes sense."""
    game = from_transitions(
        2, [1], [(0, 0, 0, [(1, 1, -1)]), (0, 1, 0, [(1, 1, -2)]), (0, 1, 1, [(1, 1, -3)])]
    )
    assert solve(game).lower[0] == pytest.approx(-1, abs=1e-6)
    for reading in (Reading.B, Reading.C):
        with pytest.raises(GameError, match="state 0: ego action 1 is not available"):
            solve(game, reading)


def test_the_checksum_of_the_rules() -> None:
    """The dense table of successors is, byte for byte, the one of the vectors."""
    table = benchmark("rings").successors_of_two(24, 7)
    found = hashlib.sha256(table.astype("<u4").tobytes()).hexdigest()
    assert found == CASES["ped_car_ring_24"]["sha256_next_state_uint32_le"]
