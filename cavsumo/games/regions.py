"""The regions from which the tester can force a goal: surely (seed, eq. 2) and almost surely.

Both are attractors: a state joins if the tester has a move that leads on against every ego action.
*Surely* means that every outcome leads on, so that there is a t with P(G | h, pi1, pi2, t) = 1 for
all pi2; the number of the layer is the least such t. *Almost surely* (lim over t of P = 1) means
that some outcome leads on and none leaves the region, the greatest X with

    A:  X = least Y of  goal or  E a1 A a2:  supp inside X  and  supp meets Y
    B:  the same with  S = {a1 : A a2 supp inside X}  and  A a2 E a1 in S:  supp meets Y
    C:  the same with  A a2 E a1:  supp inside X  and  supp meets Y

(de Alfaro, Henzinger and Kupferman, Concurrent reachability games, 2007; B with mixed strategies).
Each attractor takes time linear in the size of the game: every outcome counts down the missing
parts of its cell, every cell those of its group, every group those of its state. Groups are the
rows of a state where the tester moves first, the ego's actions where the ego does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cavsumo.games.model import Bools, Game, Ints
from cavsumo.games.readings import Reading
from cavsumo.games.segments import firsts, spans

NEVER = np.int32(np.iinfo(np.int32).max)  # so many missing parts that it is never complete


@dataclass(frozen=True, eq=False)
class Region:
    """A set of states from which the tester can force a goal.

    Attributes:
        inside: which states, shape (n,).
        layer: the step of the attractor in which each joined, 0 at goals, -1 outside.
        moves: the cells by which states joined, as a mask: in reading A all cells of the row that
            the tester plays, in B and C those that answer the ego's actions.
        outside: the states outside the first attractor, in which the ego can keep the play away
            from every goal for ever.
    """

    inside: Bools
    layer: Ints
    moves: Bools
    outside: Bools


def sure_region(game: Game, reading: Reading = Reading.A) -> Region:
    """The region in which a goal is reached within ``layer`` steps for every ego and outcome.

    Mixing does not help here, so B equals A.
    """
    every = np.ones(game.n_cells, dtype=bool)
    layer, moves = _attract(game, reading is Reading.C, every, np.diff(game.outcome_start))
    return Region(layer >= 0, layer, moves, layer < 0)


def almost_sure_region(game: Game, reading: Reading = Reading.A) -> Region:
    """The region in which a policy reaches a goal with probability 1 against every ego."""
    inside = np.ones(game.n_states, dtype=bool)
    first: Bools | None = None
    while True:
        allowed = keeping(game, reading, inside)
        layer, moves = _attract(game, reading is not Reading.A, allowed, np.int32(1))
        joined = layer >= 0
        first = ~joined if first is None else first
        if (joined == inside).all():
            return Region(joined, layer, moves, first)
        inside = joined


def keeping(game: Game, reading: Reading, inside: Bools) -> Bools:
    """The cells that the tester may use to stay inside against every ego action."""
    if inside.all():
        return np.ones(game.n_cells, dtype=bool)
    kept: Bools = inside[game.cell_state] & (game.matrix @ (~inside).astype(float) == 0)
    if reading is Reading.C or not game.n_rows:
        return kept
    whole: Bools = np.logical_and.reduceat(kept, game.cell_start[:-1])[game.cell_row]
    return whole


@dataclass(frozen=True)
class _Level:
    """Cells, groups or states of an attractor.

    Attributes:
        step: in which each was complete, -1: not yet.
        lacking: how many parts each lacks.
        whole: which group each cell, which state each group belongs to.
    """

    step: Ints
    lacking: Ints
    whole: Ints


def _attract(game: Game, ego_first: bool, allowed: Bools, lacking: Any) -> tuple[Ints, Bools]:
    """Layers and moves of an attractor to the goals by the cells that are allowed.

    Args:
        lacking: how many outcomes of a cell must lead on; a number, or one for each cell.
    """
    if ego_first:
        order, start, groups = game.replies
        group = np.empty(game.n_cells, dtype=np.int64)
        group[order] = np.repeat(np.arange(len(start) - 1), np.diff(start))
        state = np.repeat(np.arange(game.n_states), np.diff(groups))
    else:
        start, groups, group, state = (
            game.cell_start,
            game.row_start,
            game.cell_row,
            game.row_state,
        )
    cells = _level(np.where(allowed, lacking, NEVER), group)
    # All cells of some row, or some cell for each action of the ego:
    rows = _level(np.ones_like(state) if ego_first else np.diff(start), state)
    states = _level(np.diff(groups) if ego_first else np.ones_like(groups[1:]), state)
    states.step[game.goal] = 0
    _spread(game, cells, rows, states)
    layer = states.step
    moves = np.zeros(game.n_cells, dtype=bool)
    if ego_first:
        answers = (cells.step == rows.step[group]) & (layer[game.cell_state] > 0)
        moves[firsts(order[answers[order]], group)] = True
    else:
        chosen = np.zeros(len(state), dtype=bool)
        chosen[firsts(np.flatnonzero((rows.step == layer[state]) & (rows.step > 0)), state)] = True
        moves = chosen[group]
    return layer.astype(np.int64), moves


def _level(lacking: Ints, whole: Ints) -> _Level:
    lacking = lacking.astype(np.int32, copy=False)
    return _Level(np.full(len(lacking), -1, np.int32), lacking, whole)


def _spread(game: Game, cells: _Level, groups: _Level, states: _Level) -> None:
    """Set the steps of all parts from which goals are reached."""
    start, entering = game.entering
    if game.fast:
        from cavsumo.games.compiled import graphs

        parts = [(level.step, level.lacking, level.whole) for level in (cells, groups)]
        graphs.spread(start, entering, *parts[0], *parts[1], states.step, states.lacking)
        return
    frontier, step = np.flatnonzero(game.goal), 0
    while len(frontier):
        step += 1
        ready = _completed(cells, entering[spans(start, frontier)], step)
        ready = _completed(groups, cells.whole[ready], step)
        frontier = _completed(states, groups.whole[ready], step)


def _completed(level: _Level, parts: Ints, step: int) -> Ints:
    """The wholes that are completed by new parts, each of which names its whole."""
    np.subtract.at(level.lacking, parts, 1)
    found = np.sort(parts[level.lacking[parts] <= 0])
    found = found[np.diff(found, prepend=-1) > 0]  # each once
    level.step[found] = step
    level.lacking[found] = NEVER
    return found
