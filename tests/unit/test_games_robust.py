"""The solver does not depend on rounding: renumbered and perturbed games have the same bounds.

Which pairs of policies an iteration meets depends on the order of states and actions and on the
last digits of the rewards. Each game here is solved under several random orders, its rewards moved
by 1e-12 of themselves, in readings A, B and C. ``tell`` counts the solver's steps, which have a
bound that does not depend on the machine.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import DATA, benchmark

from cavsumo.games import Game, NotCertified, Unsolvable, compiled, holds, read_game, solve
from cavsumo.games.build import from_arrays, from_transitions
from cavsumo.games.files import game_of
from cavsumo.games.segments import spans, starts

VECTORS = json.loads((DATA / "ssp_games.json").read_text(encoding="utf-8"))
LISTED = [case for case in VECTORS["cases"] if "transitions" in case]
STEPS = 400  # of a solution, counted by ``tell``, far above what was met
Row = tuple[int, int, int, list[tuple[int, Any, float]]]


def random_game(rng: np.random.Generator) -> Game:
    """A game of 4 to 40 states in which much is nearly improper; the last state is the goal.

    Some tester actions wait (mostly by 1 - 1e-6, now and then for ever), some ego actions hold the
    play with probability 0.999, some cycles cost nothing or pay back what they cost, some states
    are traps, and every state has a safe action that costs more.
    """
    n = int(rng.integers(4, 41))
    many, wide = int(rng.integers(2, 4)), int(rng.integers(1, 4))
    free, trap = rng.random() < 0.15, rng.random() < 0.15
    rows: list[Row] = []
    for state in range(n - 1):
        for a1 in range(many):
            for a2 in range(wide):
                rows.append((state, a1, a2, _outcomes(rng, n, state, a1, free)))
    if trap:
        held = int(rng.integers(0, n - 1))
        rows = [row if row[0] != held else (*row[:3], [(held, 1.0, -1.0)]) for row in rows]
    return from_transitions(n, [n - 1], rows)


def _outcomes(
    rng: np.random.Generator, n: int, state: int, a1: int, free: bool
) -> list[tuple[int, Any, float]]:
    """A safe way on, a wait, or anything."""
    cost = -float(rng.integers(1, 10))
    if a1 == 0:  # safe: on to a later state, or held for a thousand steps
        later = int(rng.integers(state + 1, n))
        stay = 0.999 if rng.random() < 0.1 else 0.2
        return [(later, 1.0 - stay, 3.0 * cost), (state, stay, cost / 10)]
    kind = rng.random()
    if kind < 0.2:  # waits nearly for ever, or for ever
        leave = 0.0 if rng.random() < 0.3 else 1e-6
        stay_cost = 0.0 if free and rng.random() < 0.3 else cost
        if not leave:
            return [(state, 1.0, stay_cost)]
        return [(state, 1.0 - leave, stay_cost), (int(rng.integers(0, n)), leave, stay_cost)]
    to = rng.choice(n, size=min(n, int(rng.integers(1, 4))), replace=False)
    weights = rng.random(len(to)) + 0.05
    return [(int(t), p, cost) for t, p in zip(to, weights / weights.sum(), strict=True)]


def renumbered(game: Game, rng: np.random.Generator) -> tuple[Game, Any]:
    """The game with states and actions in another order, and the new number of each state."""
    states = rng.permutation(game.n_states)  # the old number of each new one
    number = np.argsort(states)
    rows = spans(game.row_start, states)
    rows = rows[np.lexsort((rng.random(len(rows)), number[game.row_state[rows]]))]
    cells = spans(game.cell_start, rows)
    owner = np.repeat(np.arange(len(rows)), np.diff(game.cell_start)[rows])
    cells = cells[np.lexsort((rng.random(len(cells)), owner))]
    outcomes = spans(game.outcome_start, cells)
    moved = from_arrays(
        game.goal[states],
        starts(np.diff(game.row_start)[states]),
        starts(np.diff(game.cell_start)[rows]),
        starts(np.diff(game.outcome_start)[cells]),
        number[game.successor[outcomes]],
        game.probability[outcomes],
        game.reward[cells] * (1.0 + 1e-12 * rng.uniform(-1.0, 1.0, len(cells))),
        tester_action=game.tester_action[rows],
        ego_action=game.ego_action[cells],
    )
    return moved, number


def bounds(game: Game, number: Any, reading: str) -> tuple[Any, Any] | str:
    """The bounds in the first numbering, or how the game was refused; few steps either way."""
    steps = 0

    def count(_: str, __: float) -> None:
        nonlocal steps
        steps += 1

    try:
        found = solve(game, reading, trim=True, tell=count)
    except (Unsolvable, NotCertified) as error:
        return type(error).__name__
    finally:
        assert steps <= STEPS
    assert holds(game, found.certificate)
    return found.lower[number], found.upper[number]


def agree(games: list[tuple[Game, Any]], reading: str) -> None:
    """All are refused alike, or their bounds overlap."""
    first, *others = [bounds(game, number, reading) for game, number in games]
    for other in others:
        if isinstance(first, str) or isinstance(other, str):
            assert first == other
            continue
        close = 1e-6 + 1e-11 * np.abs(first[0])
        both = np.isfinite(first[0])
        assert (both == np.isfinite(other[0])).all()
        for lower, upper in ((first[0], other[1]), (other[0], first[1])):
            assert (lower[both] <= upper[both] + close[both]).all()


def check_random(seeds: range, numberings: int, readings: str) -> None:
    """Random games, each under some numberings."""
    for seed in seeds:
        rng = np.random.default_rng(seed)
        game = random_game(rng)
        games = [renumbered(game, rng) for _ in range(numberings)]
        for reading in readings:
            agree(games, reading)


@pytest.mark.parametrize(("readings", "seeds"), [("AC", range(20)), ("B", range(20, 30))])
def test_random_games_do_not_depend_on_their_order(readings: str, seeds: range) -> None:
    """Traps, free cycles, nearly improper policies: the same bounds or the same refusal."""
    check_random(seeds, 3, readings)


def test_compiled_loops_do_not_depend_on_the_order_either(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same with numba from the first outcome on."""
    pytest.importorskip("numba")
    monkeypatch.setattr(compiled, "COMPILED", 0)
    check_random(range(30, 40), 3, "AC")


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100))
def test_a_hundred_random_games_do_not_depend_on_their_order(seed: int) -> None:
    """The same of a hundred games under twenty orders each, in every reading."""
    check_random(range(seed, seed + 1), 20, "ABC")


@pytest.mark.parametrize("case", LISTED, ids=[case["id"] for case in LISTED])
def test_the_vectors_do_not_depend_on_their_order(case: dict[str, Any]) -> None:
    """Each vector under twenty orders, the larger ones under five."""
    rng = np.random.default_rng(1)
    game = game_of(case)
    games = [renumbered(game, rng) for _ in range(5 if game.n_states > 20 else 20)]
    for reading in "ABC":
        agree(games, reading)


@pytest.mark.parametrize("reading", "AC")
@pytest.mark.parametrize("fast", [False, True])
def test_the_ring_does_not_depend_on_its_order(
    reading: str, fast: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """1,800 states, beyond direct solutions: the order decides which improper pairs are met."""
    if fast:
        pytest.importorskip("numba")
    monkeypatch.setattr(compiled, "COMPILED", 0 if fast else np.inf)
    game, rng = benchmark("rings").two_pedestrians(24, 7), np.random.default_rng(2)
    games = [renumbered(game, rng) for _ in range(15)]
    agree([games[0], games[11], games[14]], reading)  # the 12th and 15th stick with numpy


@pytest.mark.slow
def test_a_game_from_a_file_is_solved_like_the_one_written(tmp_path: Path) -> None:
    """The ring written out as ``ssp-games-1`` and read again is solved alike."""
    ring = benchmark("rings").two_pedestrians(24, 7)
    file = tmp_path / "ring.json"
    goals = np.flatnonzero(ring.goal).tolist()
    cells = [
        [*map(int, key), list(ring.outcomes(c))]
        for c, key in enumerate(
            zip(ring.cell_state, ring.tester_action[ring.cell_row], ring.ego_action, strict=True)
        )
    ]
    written = {"n_states": ring.n_states, "goal": goals, "initial": ring.initial}
    file.write_text(json.dumps(written | {"transitions": cells}), encoding="utf-8")
    game = read_game(file)
    for reading, known in (("A", -199.214858), ("C", -188.607497)):
        found = solve(game, reading)
        assert found.lower[925] - 1e-6 <= known <= found.upper[925] + 1e-6


def test_an_improper_pair_is_made_proper() -> None:
    """The greedy pair waits for ever; the values met on the way are those of a proper one."""
    wait, go = (0, 0, 0, [(0, 1, -1)]), (0, 1, 0, [(1, 1, -100)])
    found = solve(from_transitions(2, [1], [wait, go]))
    assert found.lower[0] == pytest.approx(-100, abs=1e-6)


def test_a_solver_that_is_out_of_time_says_how_far_it_came() -> None:
    """One sentence, with what was being done."""
    with pytest.raises(NotCertified, match=r"not solved within 0 s: it was at where goals"):
        solve(benchmark("rings").two_pedestrians(24, 7), time_limit=0.0)


def test_a_game_beyond_floats_ends() -> None:
    """Waits of 1 - 1e-15 in a row: floats cannot tell, and the solver ends all the same."""
    near = 2.0**-50
    chain = [(k, 0, 0, [(k + 1, near, -1.0), (0, 1.0 - near, -1.0)]) for k in range(4)]
    game = from_transitions(5, [4], chain)
    with pytest.raises(NotCertified, match="could be proven"):
        solve(game)
