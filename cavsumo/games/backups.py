"""The Bellman operator of readings A and C, in numpy; values have a last entry 0 for the goals.

A:  (T V)(s) = max over a1 of min over a2 of  r + sum over s' of T(s, a1, a2, s') V(s')
C:  (T V)(s) = min over a2 of max over a1 of  the same
"""

from __future__ import annotations

import numpy as np

from cavsumo.games.arena import Arena, Block
from cavsumo.games.model import Floats, Ints
from cavsumo.games.readings import Reading
from cavsumo.games.segments import firsts


def sweep(arena: Arena, value: Floats, shift: Floats) -> None:
    """One Gauss-Seidel sweep of V <- T V + shift in place, block by block."""
    outer, inner = _operators(arena)
    for block in arena.blocks:
        value[block.states] = _swept(arena, block, value, outer, inner) + shift[block.states]


def _operators(arena: Arena) -> tuple[np.ufunc, np.ufunc]:
    """The operators of the player that chooses groups and of the other player."""
    if arena.reading is Reading.C:
        return np.minimum, np.maximum
    return np.maximum, np.minimum


def _swept(arena: Arena, block: Block, value: Floats, outer: np.ufunc, inner: np.ufunc) -> Floats:
    """New values of a block."""
    terms = arena.probability[block.outcomes] * value[arena.successor[block.outcomes]]
    q: Floats = np.add.reduceat(terms, block.cell_outcome)
    q += arena.reward[block.cells]
    if block.group_cell is not None:
        q = inner.reduceat(q, block.group_cell)
    return q if block.state_group is None else outer.reduceat(q, block.state_group)


def backup(arena: Arena, value: Floats) -> tuple[Floats, Ints]:
    """T V - V, with its 0 for the goals, and for each state the cell that attains T V."""
    outer, inner = _operators(arena)
    advantage = arena.advantages(value)
    answer = inner.reduceat(advantage, arena.group_cell[:-1])
    best = outer.reduceat(answer, arena.state_group[:-1])
    group = firsts(np.flatnonzero(answer == best[arena.group_state]), arena.group_state)
    cell = firsts(np.flatnonzero(advantage == answer[arena.cell_group]), arena.cell_group)
    return np.append(best, 0.0), cell[group]


def answers(arena: Arena, value: Floats) -> Ints:
    """For each group the cell that the answering player takes."""
    return answers_by(arena, arena.advantages(value))


def answers_by(arena: Arena, advantage: Floats) -> Ints:
    """The same where the advantages of the cells are known."""
    _, inner = _operators(arena)
    best = inner.reduceat(advantage, arena.group_cell[:-1])
    return firsts(np.flatnonzero(advantage == best[arena.cell_group]), arena.cell_group)
