"""In which order values spread from the goals: the order of Gauss-Seidel sweeps.

On a good order one sweep carries news through the whole game, on a bad one a single step; on games
with a direction (something drives round a ring) that is a factor of a hundred. Which order is good
is not seen from the game, so several are tried: for a proper policy against some ego, the expected
number of steps is approached from below in each order, and the order that gets farthest is taken.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cavsumo.games.model import Bools, Game, Ints

SWEEPS = 8
WORTH_IT = 2000  # states from which a choice is made


def best_order(game: Game, layer: Ints, moves: Bools) -> Ints:
    """The states with a positive layer, in the order in which to sweep them."""
    live = np.flatnonzero(layer > 0)
    by_layer: Ints = live[np.argsort(layer[live], kind="stable")]
    if len(live) < WORTH_IT:
        return by_layer
    cells = np.flatnonzero(moves)
    _, first = np.unique(game.cell_state[cells], return_index=True)
    matrix = game.matrix[cells[first]][:, live]
    place = np.empty(game.n_states, dtype=np.int64)
    place[live] = np.arange(len(live))
    orders = [place[by_layer], np.arange(len(live))[::-1], np.arange(len(live))]
    orders.append(_deepest_first(matrix, int(place[by_layer[-1]])))
    best: Ints = live[max(orders, key=lambda order: _reached(matrix, order))]
    return best


def _deepest_first(matrix: Any, root: int) -> Ints:
    """States before those that lead to them, along the branches of a depth-first search."""
    from scipy.sparse.csgraph import depth_first_order

    found = depth_first_order(matrix, root, directed=True, return_predecessors=False)[::-1]
    rest = np.ones(matrix.shape[0], dtype=bool)
    rest[found] = False
    return np.concatenate((found, np.flatnonzero(rest)[::-1])).astype(np.int64)


def _reached(matrix: Any, order: Ints) -> float:
    """The sum of the expected numbers of steps, as known after some sweeps in an order."""
    from scipy.sparse import identity, tril
    from scipy.sparse.linalg import splu

    ordered = matrix[order][:, order]
    system = (identity(len(order), format="csr") - ordered).tocsr()
    try:
        sweep = splu(tril(system, format="csc"), permc_spec="NATURAL", diag_pivot_thresh=0.0)
    except RuntimeError:  # a state that this ego never lets go
        return -np.inf
    ones = np.ones(len(order))
    steps = np.zeros(len(order))
    for _ in range(SWEEPS):
        steps += sweep.solve(ones - system @ steps)
    return float(steps.sum())
