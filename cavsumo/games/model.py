"""Two-player stochastic shortest path games (seed, section 2.1) as sparse arrays.

The tuple (N, S, A, T, R, G) with finite S and A: states are 0 to n - 1, player 1 (the tester)
maximises the total reward until a goal is reached, player 2 (the ego) minimises it. Goals are
absorbing with reward 0, so they have no actions here. The arrays nest::

    state s  has the rows   row_start[s] : row_start[s + 1]            (s, a1)
    row r    has the cells  cell_start[r] : cell_start[r + 1]          (s, a1, a2)
    cell c   has outcomes   outcome_start[c] : outcome_start[c + 1]    (s, a1, a2, s')

In the seed A = A1 x A2, so all rows of a state have the same ego actions. A game in which the ego's
actions depend on the tester's is also accepted, in reading A only.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from cavsumo.errors import InputError
from cavsumo.games.compiled import worth_it

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

SUM_TOLERANCE = 1e-9  # probabilities may miss 1 by this much; they are divided by their sum


class GameError(InputError):
    """An invalid game; the message names the state, the key and the expectation."""


class Exact(NamedTuple):
    """The numbers of a game as rationals, where it was built from such.

    Attributes:
        probability: of each outcome.
        reward: expected, of each cell.
    """

    probability: tuple[Fraction, ...]
    reward: tuple[Fraction, ...]


@dataclass(frozen=True, eq=False)
class Game:
    """A finite SSP game; build one with ``cavsumo.games.build`` or read it with ``files``.

    Attributes:
        goal: which states are goals, shape (n,).
        row_start, cell_start, outcome_start: where the parts of a state, row and cell begin.
        successor: the state that an outcome leads to, int32.
        probability: of each outcome, positive, summing to 1 in each cell.
        reward: expected reward of each cell.
        tester_action: the tester's action of each row, as the builder named it.
        ego_action: the ego's action of each cell.
        initial: initial state.
        outcome_reward: reward of each outcome, None where it is the cell's.
        exact: the same numbers as rationals, None where they are not known.
        labels: names of the states in messages and pictures; None: their numbers.
        name: of the game.
    """

    goal: Bools
    row_start: Ints
    cell_start: Ints
    outcome_start: Ints
    successor: npt.NDArray[np.int32]
    probability: Floats
    reward: Floats
    tester_action: Ints
    ego_action: Ints
    initial: int = 0
    outcome_reward: Floats | None = None
    exact: Exact | None = None
    labels: tuple[Any, ...] | None = None
    name: str = ""

    @property
    def n_states(self) -> int:
        """Number of states."""
        return len(self.goal)

    @property
    def n_rows(self) -> int:
        """Number of pairs (state, tester action)."""
        return len(self.tester_action)

    @property
    def n_cells(self) -> int:
        """Number of triples (state, tester action, ego action)."""
        return len(self.ego_action)

    @property
    def fast(self) -> bool:
        """Whether the game is large enough for compiled loops and numba is installed."""
        return worth_it(len(self.successor))

    @cached_property
    def row_state(self) -> Ints:
        """The state of each row."""
        return np.repeat(np.arange(self.n_states), np.diff(self.row_start))

    @cached_property
    def cell_row(self) -> Ints:
        """The row of each cell."""
        return np.repeat(np.arange(self.n_rows), np.diff(self.cell_start))

    @cached_property
    def cell_state(self) -> Ints:
        """The state of each cell."""
        return self.row_state[self.cell_row]

    @cached_property
    def magnitude(self) -> Floats:
        """For each cell the sum of the terms in its expected reward, without their signs."""
        each = self.outcome_reward
        if each is None or self.exact is not None or not self.n_cells:
            return np.abs(self.reward)
        terms: Floats = np.add.reduceat(self.probability * np.abs(each), self.outcome_start[:-1])
        return terms * (1.0 + np.diff(self.outcome_start))  # the sum was rounded at each term

    @cached_property
    def matrix(self) -> Any:
        """T as a scipy CSR matrix, cells by states."""
        from scipy.sparse import csr_matrix

        parts = (self.probability, self.successor, self.outcome_start)
        return csr_matrix(parts, shape=(self.n_cells, self.n_states))

    @cached_property
    def entering(self) -> tuple[Ints, Ints]:
        """The cells with an outcome into each state: (where those of each state begin, cells)."""
        from scipy.sparse import csr_matrix

        there = np.ones(len(self.successor), dtype=bool)
        parts = (there, self.successor, self.outcome_start)
        found = csr_matrix(parts, shape=(self.n_cells, self.n_states)).tocsc()
        return found.indptr, found.indices

    @cached_property
    def replies(self) -> tuple[Ints, Ints, Ints]:
        """The cells ordered with the ego first: (order, start of each (s, a2), starts of states).

        Raises:
            GameError: the ego's actions depend on the tester's somewhere.
        """
        return _replies(self)

    def rows(self, state: int) -> range:
        """The rows of a state, none at a goal."""
        return range(int(self.row_start[state]), int(self.row_start[state + 1]))

    def cells(self, row: int) -> range:
        """The cells of a row."""
        return range(int(self.cell_start[row]), int(self.cell_start[row + 1]))

    def outcomes(self, cell: int) -> Iterator[tuple[int, float, float]]:
        """Successor, probability and reward of every outcome of a cell."""
        for k in range(int(self.outcome_start[cell]), int(self.outcome_start[cell + 1])):
            reward = self.reward[cell] if self.outcome_reward is None else self.outcome_reward[k]
            yield int(self.successor[k]), float(self.probability[k]), float(reward)

    def label(self, state: int) -> str:
        """The name of a state in messages."""
        return str(state if self.labels is None else self.labels[state])


def _replies(game: Game) -> tuple[Ints, Ints, Ints]:
    """See ``Game.replies``."""
    order = np.lexsort((game.cell_row, game.ego_action, game.cell_state))
    state, ego = game.cell_state[order], game.ego_action[order]
    first = np.ones(len(order), dtype=bool)
    first[1:] = (state[1:] != state[:-1]) | (ego[1:] != ego[:-1])
    start = np.append(np.flatnonzero(first), len(order))
    group_state = state[start[:-1]]
    whole = np.diff(start) == np.diff(game.row_start)[group_state]
    if not whole.all():
        k = int(np.flatnonzero(~whole)[0])
        raise GameError(
            f"state {game.label(int(group_state[k]))}: ego action {ego[start[k]]} is not "
            "available against every tester action; only reading A can be asked of such a game"
        )
    groups = np.searchsorted(group_state, np.arange(game.n_states + 1))
    return order, start, groups


def check(game: Game) -> Game:
    """The game itself, if it is valid.

    Raises:
        GameError: it has no goal, a state without actions, an invalid probability, ...
    """
    _check_states(game)
    _check_outcomes(game)
    return game


def _check_states(game: Game) -> None:
    """Goals, initial state and non-empty action sets."""
    if not game.goal.any():
        raise GameError("goal: expected at least one goal state")
    if not 0 <= game.initial < game.n_states:
        raise GameError(f"initial: expected a state below {game.n_states}, got {game.initial}")
    none = np.flatnonzero((np.diff(game.row_start) == 0) & ~game.goal)
    if len(none):
        raise GameError(f"state {none[0]}: expected at least one action, as it is no goal")
    some = np.flatnonzero((np.diff(game.row_start) > 0) & game.goal)
    if len(some):
        raise GameError(f"state {some[0]}: a goal is absorbing and has no actions")
    for what, start, owner in (
        ("ego action", game.cell_start, game.row_state),
        ("outcome", game.outcome_start, game.cell_state if game.n_cells else game.row_state),
    ):
        none = np.flatnonzero(np.diff(start) == 0)
        if len(none):
            raise GameError(f"state {owner[none[0]]}: expected at least one {what} for each action")


def _check_outcomes(game: Game) -> None:
    """Successors, probabilities and rewards."""
    if not game.n_cells:
        return
    _every(game, (game.successor >= 0) & (game.successor < game.n_states), "a successor", "state")
    _every(game, game.probability > 0, "a probability", "positive number")
    for numbers in (game.reward, game.outcome_reward):
        if numbers is not None and not np.isfinite(numbers).all():
            raise GameError("rewards: expected finite numbers")
    total = np.add.reduceat(game.probability, game.outcome_start[:-1])
    off = np.flatnonzero(~(np.abs(total - 1.0) <= SUM_TOLERANCE))
    if len(off):
        raise GameError(
            f"{where(game, int(off[0]))}: expected probabilities that sum to 1, "
            f"got {total[off[0]]:.12g}"
        )


def _every(game: Game, good: Bools, what: str, expected: str) -> None:
    """Raise GameError that names the first invalid outcome."""
    bad = np.flatnonzero(~good)
    if len(bad):
        cell = int(np.searchsorted(game.outcome_start, bad[0], side="right")) - 1
        raise GameError(f"{where(game, cell)}: {what} is no {expected}")


def where(game: Game, cell: int) -> str:
    """A cell in words."""
    row = int(game.cell_row[cell])
    return (
        f"state {game.row_state[row]}, tester action {game.tester_action[row]}, "
        f"ego action {game.ego_action[cell]}"
    )
