"""Readings A and C, in which one player commits first and the other answers.

A pair of policies is the cell that is played in each state. The tester's policy is the group it
commits to in each state in reading A, its answer in each group in reading C.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from cavsumo.games import backups
from cavsumo.games.arena import Arena
from cavsumo.games.model import Bools, Floats, Game, Ints
from cavsumo.games.readings import Reading
from cavsumo.games.segments import firsts


class TurnBased:
    """See ``Play``."""

    sweeps = 1

    def __init__(self, arena: Arena, moves: Bools) -> None:
        """``moves``: the cells of the game by which its states joined the almost-sure region."""
        self.arena = arena
        self._last: tuple[Ints, Any] | None = None  # pairs come again, shifted: their transitions
        self._bellman: Any = backups
        if arena.fast:
            from cavsumo.games.compiled import bellman

            self._bellman = bellman
        self._moves = moves

    @cached_property
    def first(self) -> Ints:
        """See ``Play``; most games are solved without it."""
        a = self.arena
        allowed = np.flatnonzero(self._moves[a.cells])
        if a.reading is Reading.A:
            return a.cell_group[firsts(allowed, a.cell_state)]
        return firsts(allowed, a.cell_group)

    def sweep(self, value: Floats, shift: Floats) -> None:
        """See ``Play``."""
        self._bellman.sweep(self.arena, value, shift)

    def backup(self, value: Floats) -> tuple[Floats, Ints]:
        """See ``Play``."""
        found: tuple[Floats, Ints] = self._bellman.backup(self.arena, value)
        return found

    def reply(self, held: Ints, value: Floats) -> tuple[Floats, Ints]:
        """See ``Play``."""
        a = self.arena
        advantage = a.advantages(value)
        if a.reading is Reading.A:
            pair = backups.answers_by(a, advantage)[held]
        else:
            best = np.minimum.reduceat(advantage[held], a.state_group[:-1])
            attained = np.flatnonzero(advantage[held] == best[a.group_state])
            pair = held[firsts(attained, a.group_state)]
        return np.append(advantage[pair], 0.0), pair

    def improved(self, held: Ints, value: Floats, margin: float) -> Ints:
        """See ``Play``."""
        a = self.arena
        advantage = a.advantages(value)
        answers = backups.answers_by(a, advantage)
        if a.reading is Reading.C:
            return np.where(advantage[answers] > advantage[held] + margin, answers, held)
        worth = advantage[answers]
        best = np.maximum.reduceat(worth, a.state_group[:-1])
        chosen = firsts(np.flatnonzero(worth == best[a.group_state]), a.group_state)
        return np.where(worth[chosen] > worth[held] + margin, chosen, held)

    def held_first(self, held: Ints, where: Bools) -> Ints:
        """See ``Play``."""
        a = self.arena
        chosen = where if a.reading is Reading.A else where[a.group_state]
        return np.where(chosen, self.first, held)

    def pair_first(self, pair: Ints, value: Floats, where: Bools) -> Ints:
        """See ``Play``."""
        a = self.arena
        if a.reading is Reading.A:
            return np.where(where, self._answers(value)[self.first], pair)
        return np.where(where, self.first[a.cell_group[pair]], pair)

    def system(self, pair: Ints) -> tuple[Any, Floats]:
        """See ``Play``."""
        if self._last is None or not np.array_equal(self._last[0], pair):
            self._last = pair, self.arena.transitions(pair)
        return self._last[1], np.append(self.arena.reward[pair], 0.0)

    def tester(self, game: Game, pair: Ints, value: Floats) -> Floats:
        """See ``Play``."""
        if self.arena.reading is Reading.C:
            return self._answering(game, value)
        return self._choices(game, pair, game.cell_row)

    def ego(self, game: Game, pair: Ints, value: Floats) -> Floats:
        """See ``Play``."""
        if self.arena.reading is Reading.A:
            return self._answering(game, value)
        return self._choices(game, pair, game.ego_action)

    def _answers(self, value: Floats) -> Ints:
        """For each group of cells the one that the player who moves second takes."""
        if len(self.arena.group_cell) - 1 == len(self.arena.cells):
            return np.arange(len(self.arena.cells))  # no choice
        found: Ints = self._bellman.answers(self.arena, value)
        return found

    def _answering(self, game: Game, value: Floats) -> Floats:
        """The answers as weights of the game's cells."""
        weights = np.zeros(game.n_cells)
        weights[self.arena.cells[self._answers(value)]] = 1.0
        return weights

    def _choices(self, game: Game, pair: Ints, key: Ints) -> Floats:
        """The choices of the player who moves first: the cells that share a key with the pair's."""
        chosen = np.full(game.n_states, np.iinfo(np.int64).min)
        chosen[self.arena.states] = key[self.arena.cells[pair]]
        weights: Floats = (key == chosen[game.cell_state]).astype(float)
        return weights
