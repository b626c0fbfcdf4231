"""The three readings behind one face: sweep, back up, value a pair of policies.

What ``solve`` does to a game is the same in every reading; how a state is backed up and what a
pair of policies is differs. Values have a last entry, 0, for the goals.
"""

from __future__ import annotations

import dataclasses
from typing import Any, Protocol

import numpy as np

from cavsumo.games import backups
from cavsumo.games.arena import Arena, arena
from cavsumo.games.matrix_games import solve
from cavsumo.games.model import Bools, Floats, Game, Ints
from cavsumo.games.pairs import pair_value
from cavsumo.games.readings import Reading
from cavsumo.games.segments import spans, starts


class Play(Protocol):
    """A game in one reading, ready to be solved."""

    arena: Arena
    sweeps: int  # before the first jump to the value of a pair

    def sweep(self, value: Floats, shift: Floats) -> None:
        """V <- T V + shift, in place, from the goals outward."""

    def backup(self, value: Floats) -> tuple[Floats, Any]:
        """T V - V and the pair of policies that attains T V."""

    def system(self, pair: Any) -> tuple[Any, Floats]:
        """Transitions between states and rewards under a pair; the last state is the goals'."""

    def tester(self, game: Game, pair: Any, value: Floats) -> Floats:
        """The tester's part of a pair as weights of the game's cells (``certificate``)."""

    def ego(self, game: Game, pair: Any, value: Floats) -> Floats:
        """The ego's part."""


def play_of(game: Game, reading: Reading, states: Ints, kept: Bools | None) -> Play:
    """The states of a game, in the order of sweeps, in a reading."""
    if reading is Reading.B:
        return Simultaneous(game, states, kept)
    return TurnBased(arena(game, reading, states, kept))


def value_of(
    play: Play, pair: Any, start: Floats, shift: Floats, residual: float, precise: bool
) -> Floats | None:
    """The value of a pair with rewards raised by the ``shift`` of their state, None without one."""
    transitions, reward = play.system(pair)
    return pair_value(
        transitions, reward + shift, start, residual, precise=precise, fast=play.arena.fast
    )


def time_of(play: Play, pair: Any) -> Floats | None:
    """Nearly the expected number of steps to a goal under a pair, None if it may be infinite."""
    transitions, _ = play.system(pair)
    ones = np.append(np.ones(play.arena.size), 0.0)
    found = pair_value(transitions, ones, ones, 1e-2, fast=play.arena.fast)
    return None if found is None or (found[:-1] < 0.9).any() else found


class TurnBased:
    """Readings A and C; a pair is the cell that is played in each state."""

    sweeps = 1

    def __init__(self, arena: Arena) -> None:
        self.arena = arena
        self._last: tuple[Ints, Any] | None = None  # pairs come again, shifted: their transitions
        self._bellman: Any = backups
        if arena.fast:
            from cavsumo.games.compiled import bellman

            self._bellman = bellman

    def sweep(self, value: Floats, shift: Floats) -> None:
        """See ``Play``."""
        self._bellman.sweep(self.arena, value, shift)

    def backup(self, value: Floats) -> tuple[Floats, Ints]:
        """See ``Play``."""
        found: tuple[Floats, Ints] = self._bellman.backup(self.arena, value)
        return found

    def system(self, pair: Ints) -> tuple[Any, Floats]:
        """See ``Play``."""
        if self._last is None or not np.array_equal(self._last[0], pair):
            self._last = pair, self.arena.transitions(pair)
        return self._last[1], np.append(self.arena.reward[pair], 0.0)

    def tester(self, game: Game, pair: Ints, value: Floats) -> Floats:
        """See ``Play``."""
        if self.arena.reading is Reading.C:
            return self._answers(game, value)
        return self._choices(game, pair, game.cell_row)

    def ego(self, game: Game, pair: Ints, value: Floats) -> Floats:
        """See ``Play``."""
        if self.arena.reading is Reading.A:
            return self._answers(game, value)
        return self._choices(game, pair, game.ego_action)

    def _answers(self, game: Game, value: Floats) -> Floats:
        """Whoever moves second, in every group of cells."""
        weights = np.zeros(game.n_cells)
        weights[self.arena.cells[backups.answers(self.arena, value)]] = 1.0
        return weights

    def _choices(self, game: Game, pair: Ints, key: Ints) -> Floats:
        """Whoever moves first: all cells that share the key with the state's cell."""
        chosen = np.full(game.n_states, np.iinfo(np.int64).min)
        chosen[self.arena.states] = key[self.arena.cells[pair]]
        weights: Floats = (key == chosen[game.cell_state]).astype(float)
        return weights


class Simultaneous:
    """Reading B; a pair is the weights of all rows (R) and of all ego actions (C) of the states."""

    sweeps = 0  # a sweep costs as much as a backup: linear programs

    def __init__(self, game: Game, states: Ints, kept: Bools | None) -> None:
        _ = game.replies  # every ego action is there against every tester action, or GameError
        self.arena = arena(_sorted(game), Reading.A, states, kept)
        self._order = np.lexsort((game.ego_action, game.cell_row))
        a = self.arena
        many = np.diff(a.state_group)
        self._columns = starts(np.diff(a.group_cell)[a.state_group[:-1]])
        wide = np.diff(self._columns)
        self._column = np.arange(len(a.cells)) - np.repeat(a.group_cell[:-1], np.diff(a.group_cell))
        self._column += self._columns[a.group_state[a.cell_group]]
        shapes = np.unique(np.stack([many, wide], axis=1), axis=0)
        self._alike = [
            (m, w, np.flatnonzero((many == m) & (wide == w))) for m, w in shapes.tolist()
        ]

    def sweep(self, value: Floats, shift: Floats) -> None:
        """See ``Play``."""
        value += self.backup(value)[0] + shift

    def backup(self, value: Floats) -> tuple[Floats, tuple[Floats, Floats]]:
        """See ``Play``."""
        a = self.arena
        q = a.advantages(value)
        best = np.zeros(a.size + 1)
        rows, columns = np.zeros(len(a.group_cell) - 1), np.zeros(int(self._columns[-1]))
        for many, wide, states in self._alike:
            first = a.group_cell[a.state_group[states]]
            found = solve(q[first[:, None] + np.arange(many * wide)].reshape(-1, many, wide))
            best[states] = found.value
            rows[a.state_group[states][:, None] + np.arange(many)] = found.rows
            columns[self._columns[states][:, None] + np.arange(wide)] = found.columns
        return best, (rows, columns)

    def system(self, pair: tuple[Floats, Floats]) -> tuple[Any, Floats]:
        """See ``Play``."""
        from scipy.sparse import csr_matrix

        a, (rows, columns) = self.arena, pair
        weight = rows[a.cell_group] * columns[self._column]
        used = np.flatnonzero(weight)
        state = a.group_state[a.cell_group[used]]
        mix = csr_matrix((weight[used], (state, used)), shape=(a.size + 1, len(a.cells)))
        return (mix @ a.matrix).tocsr(), mix @ a.reward

    def tester(self, game: Game, pair: tuple[Floats, Floats], value: Floats) -> Floats:
        """See ``Play``."""
        return self._weights(game, pair[0][self.arena.cell_group])

    def ego(self, game: Game, pair: tuple[Floats, Floats], value: Floats) -> Floats:
        """See ``Play``."""
        weights = self._weights(game, pair[1][self._column])
        order, start, _ = game.replies
        most = np.maximum.reduceat(weights[order], start[:-1])  # also for rows that are not kept
        whole = np.empty(game.n_cells)
        whole[order] = np.repeat(most, np.diff(start))
        return whole

    def _weights(self, game: Game, weights: Floats) -> Floats:
        """Weights of the arena's cells as weights of the game's."""
        found = np.zeros(game.n_cells)
        found[self._order[self.arena.cells]] = weights
        return found


def _sorted(game: Game) -> Game:
    """The game with the cells of each row in the order of the ego's actions."""
    order = np.lexsort((game.ego_action, game.cell_row))
    if (order == np.arange(game.n_cells)).all():
        return game
    outcome = spans(game.outcome_start, order)
    sizes = np.diff(game.outcome_start)[order]
    return dataclasses.replace(
        game,
        outcome_start=starts(sizes),
        successor=game.successor[outcome],
        probability=game.probability[outcome],
        reward=game.reward[order],
        ego_action=game.ego_action[order],
        outcome_reward=None,
        exact=None,
    )
