"""The order in which values propagate from the goals: the order of Gauss-Seidel sweeps.

In a good order one sweep propagates values through the whole game, in a bad order by a single step;
in games with a direction (a vehicle on a ring, say) that is a factor of a hundred. The game does
not show which order is good, so several are tried: for a proper policy against some ego, the
expected number of steps is approached from below in each order, and the order with the largest
result is taken.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cavsumo.games.model import Bools, Game, Ints
from cavsumo.games.segments import firsts, gathered, starts

SWEEPS = 2
WORTH_IT = 2000  # states from which a choice is made


def best_order(game: Game, layer: Ints, moves: Bools) -> Ints:
    """The states with a positive layer, in the order in which to sweep them."""
    live = np.flatnonzero(layer > 0)
    by_layer: Ints = live[np.argsort(layer[live], kind="stable")]
    if len(live) < WORTH_IT:
        return by_layer
    matrix = _one_move(game, moves)
    orders = [by_layer, live[::-1].copy(), live, _deepest_first(matrix, live, by_layer[-1])]
    return max(orders, key=lambda order: _reached(matrix, order, game.fast))


def _one_move(game: Game, moves: Bools) -> Any:
    """Transitions between states under the first move of each, none from goals."""
    from scipy.sparse import csr_matrix

    cells, n = firsts(np.flatnonzero(moves), game.cell_state), game.n_states
    parts = (game.outcome_start, game.successor, game.probability, cells)
    begin, to, chance = gathered(*parts, np.arange(n, dtype=np.int32), game.fast)
    sizes = np.zeros(n, dtype=np.int64)
    sizes[game.cell_state[cells]] = np.diff(begin)
    return csr_matrix((chance, to, starts(sizes)), shape=(n, n))


def _deepest_first(matrix: Any, live: Ints, root: int) -> Ints:
    """States before those that lead to them, along the branches of a depth-first search."""
    from scipy.sparse.csgraph import depth_first_order

    found = depth_first_order(matrix, root, directed=True, return_predecessors=False)[::-1]
    rest = np.zeros(matrix.shape[0], dtype=bool)
    rest[live] = True
    found = found[rest[found]].astype(np.int64)
    rest[found] = False
    return np.concatenate((found, np.flatnonzero(rest)[::-1]))


def _reached(matrix: Any, order: Ints, fast: bool) -> float:
    """The sum of the expected numbers of steps, as known after some sweeps in an order.

    -inf where this ego never lets a state go.
    """
    if fast:
        from cavsumo.games.compiled import systems

        return float(systems.reached(matrix.indptr, matrix.indices, matrix.data, order, SWEEPS))
    return _reached_by_factors(matrix[order][:, order])


def _reached_by_factors(matrix: Any) -> float:
    """``_reached`` in the order of the matrix."""
    from scipy.sparse import identity, tril
    from scipy.sparse.linalg import splu

    system = (identity(matrix.shape[0], format="csr") - matrix).tocsr()
    if (system.diagonal() <= 0.0).any():
        return -np.inf
    sweep = splu(tril(system, format="csc"), permc_spec="NATURAL", diag_pivot_thresh=0.0)
    ones = np.ones(matrix.shape[0])
    steps = np.zeros(matrix.shape[0])
    for _ in range(SWEEPS):
        steps += sweep.solve(ones - system @ steps)
    return float(steps.sum())
