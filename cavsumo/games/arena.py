"""A game prepared for the solver: without goals, states in the order in which values propagate.

States are renumbered in the order in which values propagate (``flow``), so that a value depends
mostly on values before it and one Gauss-Seidel sweep updates most of them. Each state has groups of
cells, each group cells: in reading A the tester chooses the group (a row) and the ego the cell, in
reading C the ego the group (its action) and the tester the cell.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from cavsumo.games.advantages import advantages
from cavsumo.games.model import Bools, Floats, Game, Ints
from cavsumo.games.readings import Reading
from cavsumo.games.segments import gathered, spans, starts

BLOCK = 128  # states that are swept at a time, at least


class Block(NamedTuple):
    """A run of states with their groups, cells and outcomes, indices counted from the run's own."""

    states: slice
    cells: slice
    outcomes: slice
    cell_outcome: Ints
    group_cell: Ints | None  # None: each group has one cell
    state_group: Ints | None  # None: each state has one group


@dataclass(frozen=True, eq=False)
class Arena:
    """The part of a game that is solved, seen in one reading.

    Attributes:
        reading: A (also for B, whose matrices have the tester's rows as groups) or C.
        states: the game's number of each state, in the order of solving, shape (m,).
        cells: the game's number of each cell.
        state_group, group_cell, cell_outcome: where the parts begin.
        successor: of each outcome, m for goals, int32.
        probability: of each outcome.
        reward: of each cell.
        fast: whether compiled loops are used.
    """

    reading: Reading
    states: Ints
    cells: Ints
    state_group: Ints
    group_cell: Ints
    cell_outcome: Ints
    successor: npt.NDArray[np.int32]
    probability: Floats
    reward: Floats
    fast: bool

    @property
    def size(self) -> int:
        """Number of states that are not goals."""
        return len(self.states)

    @cached_property
    def cell_group(self) -> Ints:
        """The group of each cell."""
        return np.repeat(np.arange(len(self.group_cell) - 1), np.diff(self.group_cell))

    @cached_property
    def group_state(self) -> Ints:
        """The state of each group."""
        return np.repeat(np.arange(self.size), np.diff(self.state_group))

    @cached_property
    def cell_state(self) -> Ints:
        """The state of each cell."""
        return self.group_state[self.cell_group]

    @cached_property
    def scale(self) -> float:
        """The size of rewards."""
        return max(float(self.reward.max(initial=0.0)), -float(self.reward.min(initial=0.0))) or 1.0

    def advantages(self, value: Floats) -> Floats:
        """r + sum of p V(s') - V(s) of every cell."""
        parts = (self.cell_outcome, self.successor, self.probability, self.reward, self.cell_state)
        return advantages(*parts, value, self.fast)[0]

    @cached_property
    def matrix(self) -> Any:
        """Transitions, cells by states and, last, the goals."""
        from scipy.sparse import csr_matrix

        parts = (self.probability, self.successor, self.cell_outcome)
        return csr_matrix(parts, shape=(len(self.cells), self.size + 1))

    def transitions(self, cells: Ints) -> Any:
        """Those of one cell a state, as a square CSR matrix; the last state is the goals'."""
        from scipy.sparse import csr_matrix

        here = np.arange(self.size + 1, dtype=np.int32)
        parts = (self.cell_outcome, self.successor, self.probability)
        start, to, chance = gathered(*parts, cells, here, self.fast)
        square = (self.size + 1, self.size + 1)
        return csr_matrix((chance, to, np.append(start, start[-1])), shape=square)

    @cached_property
    def blocks(self) -> list[Block]:
        """The states in runs for sweeps."""
        length = max(BLOCK, self.size // 512)
        cuts = [*range(0, self.size, length), self.size]
        return [_block(self, a, b) for a, b in pairwise(cuts)]


def arena(game: Game, reading: Reading, live: Ints, kept: Bools | None = None) -> Arena:
    """Lay out states in the order given, with their cells, or those that are kept."""
    ego_first = reading is Reading.C
    if ego_first:
        order, start, groups = game.replies
    else:
        order, start, groups = None, game.cell_start, game.row_start
    group = spans(groups, live, game.fast)
    place = spans(start, group, game.fast)
    group_size, state_size = np.diff(start)[group], np.diff(groups)[live]
    cells = place if order is None else order[place]
    if kept is not None:
        owner = np.repeat(np.arange(len(group)), group_size)[kept[cells]]
        cells = cells[kept[cells]]
        group_size = np.bincount(owner, minlength=len(group))
        some = group_size > 0
        state = np.repeat(np.arange(len(live)), state_size)[some]
        group_size, state_size = group_size[some], np.bincount(state, minlength=len(live))
    number = np.full(game.n_states, len(live), dtype=np.int32)
    number[live] = np.arange(len(live))
    begin, successor, probability = gathered(
        game.outcome_start, game.successor, game.probability, cells, number, game.fast
    )
    return Arena(
        Reading.C if ego_first else Reading.A,
        live,
        cells,
        starts(state_size),
        starts(group_size),
        begin,
        successor,
        probability,
        game.reward[cells],
        game.fast,
    )


def _block(a: Arena, first: int, last: int) -> Block:
    """The states first to last, excluded, with their parts."""
    groups = a.state_group[first : last + 1]
    cells = a.group_cell[groups[0] : groups[-1] + 1]
    outcomes = a.cell_outcome[cells[0] : cells[-1] + 1]
    simple = len(cells) - 1 == cells[-1] - cells[0]
    single = len(groups) - 1 == groups[-1] - groups[0]
    return Block(
        slice(first, last),
        slice(int(cells[0]), int(cells[-1])),
        slice(int(outcomes[0]), int(outcomes[-1])),
        outcomes[:-1] - outcomes[0],
        None if simple else cells[:-1] - cells[0],
        None if single else groups[:-1] - groups[0],
    )
