"""Where the tester can force a goal: surely (seed, eq. 2 to the letter) and almost surely.

Both are attractors: a state joins when the tester has a move that leads on, whatever the ego does.
*Surely* means that every outcome leads on, so that there is a t with P(G | h, pi1, pi2, t) = 1 for
all pi2; the number of the layer is the least such t. *Almost surely* (lim over t of P = 1) means
that some outcome leads on and none leaves the region, the greatest X with

    A:  X = least Y of  goal or  E a1 A a2:  supp inside X  and  supp meets Y
    B:  the same with  S = {a1 : A a2 supp inside X}  and  A a2 E a1 in S:  supp meets Y
    C:  the same with  A a2 E a1:  supp inside X  and  supp meets Y

(de Alfaro, Henzinger and Kupferman, Concurrent reachability games, 2007; B with mixed strategies).
Each attractor takes time linear in the size of the game.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cavsumo.games.model import Bools, Game, Ints
from cavsumo.games.readings import Reading


@dataclass(frozen=True, eq=False)
class Region:
    """A set of states from which the tester can force a goal.

    Attributes:
        inside: which states, shape (n,).
        layer: the step of the attractor in which each joined, 0 at goals, -1 outside.
        moves: the cells by which states joined, as a mask: in reading A all cells of the row that
            the tester plays, in B and C those that answer the ego's actions.
        outside: the states left over by the first attractor: there the ego can keep the play
            away from every goal for ever.
    """

    inside: Bools
    layer: Ints
    moves: Bools
    outside: Bools


def sure_region(game: Game, reading: Reading = Reading.A) -> Region:
    """Where a goal is reached within ``layer`` steps, whatever the ego and chance do.

    Mixing is of no help here, so B is A.
    """
    every = np.ones(game.n_cells, dtype=bool)
    layer, moves = _attract(game, reading is Reading.C, every, sure=True)
    return Region(layer >= 0, layer, moves, layer < 0)


def almost_sure_region(game: Game, reading: Reading = Reading.A) -> Region:
    """Where the tester has a policy that reaches a goal with probability 1 against any ego."""
    inside = np.ones(game.n_states, dtype=bool)
    first: Bools | None = None
    while True:
        allowed = keeping(game, reading, inside)
        layer, moves = _attract(game, reading is not Reading.A, allowed, sure=False)
        joined = layer >= 0
        first = ~joined if first is None else first
        if (joined == inside).all():
            return Region(joined, layer, moves, first)
        inside = joined


def keeping(game: Game, reading: Reading, inside: Bools) -> Bools:
    """The cells that the tester may use to stay inside, whatever the ego does."""
    kept: Bools = inside[game.cell_state] & (game.matrix @ (~inside).astype(float) == 0)
    if reading is Reading.C or not game.n_rows:
        return kept
    whole: Bools = np.logical_and.reduceat(kept, game.cell_start[:-1])[game.cell_row]
    return whole


def spans(start: Ints, which: Ints) -> Ints:
    """The concatenated ranges start[w] : start[w + 1] for each w in ``which``."""
    begin, length = start[which], start[which + 1] - start[which]
    ends = np.cumsum(length)
    total = int(ends[-1]) if len(ends) else 0
    found: Ints = np.arange(total) + np.repeat(begin - ends + length, length)
    return found


def _attract(game: Game, ego_first: bool, allowed: Bools, sure: bool) -> tuple[Ints, Bools]:
    """Layers and moves of an attractor to the goals, layer by layer, each entry looked at once."""
    entering = game.matrix.tocsc()
    door = _ReplyDoor(game) if ego_first else _RowDoor(game)
    lacking = np.diff(game.outcome_start) if sure else np.ones(game.n_cells, dtype=np.int64)
    layer = np.where(game.goal, 0, -1)
    moves = np.zeros(game.n_cells, dtype=bool)
    frontier, step = np.flatnonzero(game.goal), 0
    while len(frontier):
        step += 1
        hit = entering.indices[spans(entering.indptr, frontier)]
        np.subtract.at(lacking, hit, 1)
        hit = np.unique(hit)
        ready = hit[allowed[hit] & (lacking[hit] <= 0)]
        ready = ready[~door.seen[ready]]
        states, cells = door.open(ready)
        fresh = layer[states] < 0
        moves[cells[layer[game.cell_state[cells]] < 0]] = True
        frontier = np.unique(states[fresh])
        layer[frontier] = step
    return layer, moves & (layer[game.cell_state] >= 0)


class _RowDoor:
    """A state joins by a row all of whose cells are ready (E a1 A a2)."""

    def __init__(self, game: Game) -> None:
        self.game = game
        self.lacking = np.diff(game.cell_start)
        self.seen = np.zeros(game.n_cells, dtype=bool)
        self.joined = np.zeros(game.n_states, dtype=bool)

    def open(self, cells: Ints) -> tuple[Ints, Ints]:
        """States that may join by these cells, and the cells by which they do."""
        self.seen[cells] = True
        rows = self.game.cell_row[cells]
        np.subtract.at(self.lacking, rows, 1)
        rows = np.unique(rows)
        rows = rows[self.lacking[rows] == 0]
        states, first = np.unique(self.game.row_state[rows], return_index=True)
        new = ~self.joined[states]
        self.joined[states] = True
        return states[new], spans(self.game.cell_start, rows[first[new]])


class _ReplyDoor:
    """A state joins when each action of the ego has a ready cell (A a2 E a1)."""

    def __init__(self, game: Game) -> None:
        order, start, groups = game.replies
        self.game = game
        self.group = np.empty(game.n_cells, dtype=np.int64)
        self.group[order] = np.repeat(np.arange(len(start) - 1), np.diff(start))
        self.lacking = np.diff(groups)
        self.seen = np.zeros(game.n_cells, dtype=bool)
        self.answered = np.zeros(len(start) - 1, dtype=bool)

    def open(self, cells: Ints) -> tuple[Ints, Ints]:
        """States that may join by these cells, and the cells that newly answer an action."""
        self.seen[cells] = True
        groups, first = np.unique(self.group[cells], return_index=True)
        new = ~self.answered[groups]
        self.answered[groups] = True
        answering: Any = cells[first[new]]
        states = self.game.cell_state[answering]
        np.subtract.at(self.lacking, states, 1)
        states = np.unique(states)
        return states[self.lacking[states] == 0], answering
