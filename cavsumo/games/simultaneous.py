"""Reading B, in which both players choose at once and may mix.

A pair of policies is the weights of all rows and of all ego actions of the states; the tester's
policy is the weights of the rows.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from cavsumo.games.arena import arena
from cavsumo.games.matrix_games import solve
from cavsumo.games.model import Bools, Floats, Game, Ints
from cavsumo.games.readings import Reading
from cavsumo.games.segments import firsts, spans, starts

Pair = tuple[Floats, Floats]


class Simultaneous:
    """See ``Play``."""

    sweeps = 0  # a sweep costs as much as a backup: linear programs

    def __init__(self, game: Game, states: Ints, kept: Bools | None, moves: Bools) -> None:
        """``moves``: the cells of the game by which its states joined the almost-sure region."""
        _ = game.replies  # every ego action is there against every tester action, or GameError
        self.arena = arena(_sorted(game), Reading.A, states, kept)
        self._order = np.lexsort((game.ego_action, game.cell_row))
        a = self.arena
        many = np.diff(a.state_group)
        self._columns = starts(np.diff(a.group_cell)[a.state_group[:-1]])
        wide = np.diff(self._columns)
        self._column = np.arange(len(a.cells)) - np.repeat(a.group_cell[:-1], np.diff(a.group_cell))
        self._column += self._columns[a.group_state[a.cell_group]]
        self._column_state = np.repeat(np.arange(a.size), wide)
        shapes = np.unique(np.stack([many, wide], axis=1), axis=0)
        self._alike = [
            (m, w, np.flatnonzero((many == m) & (wide == w))) for m, w in shapes.tolist()
        ]
        used = np.zeros(len(many) and int(a.state_group[-1]))
        used[a.cell_group[moves[self._order[a.cells]]]] = 1.0
        self.first = used / np.add.reduceat(used, a.state_group[:-1])[a.group_state]

    def sweep(self, value: Floats, shift: Floats) -> None:
        """See ``Play``."""
        value += self.backup(value)[0] + shift

    def backup(self, value: Floats) -> tuple[Floats, Pair]:
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

    def reply(self, held: Floats, value: Floats) -> tuple[Floats, Pair]:
        """See ``Play``."""
        worth, begin = self._worth(held, value), self._columns[:-1]
        best = np.minimum.reduceat(worth, begin)
        columns = np.zeros(len(worth))
        attained = np.flatnonzero(worth == best[self._column_state])
        columns[firsts(attained, self._column_state)] = 1.0
        return np.append(best, 0.0), (held, columns)

    def _worth(self, rows: Floats, value: Floats) -> Floats:
        """The advantage of every action of the ego against the weights of the rows."""
        a = self.arena
        mixed = rows[a.cell_group] * a.advantages(value)
        return np.bincount(self._column, mixed, int(self._columns[-1])).astype(float)

    def improved(self, held: Floats, value: Floats, margin: float) -> Floats:
        """See ``Play``."""
        a = self.arena
        best, (rows, _) = self.backup(value)
        now = np.minimum.reduceat(self._worth(held, value), self._columns[:-1])
        better = best[:-1] > now + margin
        return np.where(better[a.group_state], rows, held)

    def held_first(self, held: Floats, where: Bools) -> Floats:
        """See ``Play``."""
        return np.where(where[self.arena.group_state], self.first, held)

    def pair_first(self, pair: Pair, value: Floats, where: Bools) -> Pair:
        """See ``Play``."""
        return self.held_first(pair[0], where), pair[1]

    def system(self, pair: Pair) -> tuple[Any, Floats]:
        """See ``Play``."""
        from scipy.sparse import csr_matrix

        a, (rows, columns) = self.arena, pair
        weight = rows[a.cell_group] * columns[self._column]
        used = np.flatnonzero(weight)
        state = a.group_state[a.cell_group[used]]
        mix = csr_matrix((weight[used], (state, used)), shape=(a.size + 1, len(a.cells)))
        return (mix @ a.matrix).tocsr(), mix @ a.reward

    def tester(self, game: Game, pair: Pair, value: Floats) -> Floats:
        """See ``Play``."""
        return self._weights(game, pair[0][self.arena.cell_group])

    def ego(self, game: Game, pair: Pair, value: Floats) -> Floats:
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
