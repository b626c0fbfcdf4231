"""Values over a finite horizon, by backward induction (reading A)::

    V_0 = 0
    V_k(s) = max over a1 of min over a2 of  r + sum over s' of T(s, a1, a2, s') V_{k-1}(s')

They exist for every game, solvable or not. Where no player has a choice and the reward is the
probability of an event, V_k is the probability that it happens within k actions.
"""

from __future__ import annotations

import numpy as np

from cavsumo.games.model import Floats, Game


def horizon_values(game: Game, steps: int) -> Floats:
    """V_0 to V_steps of every state, shape (steps + 1, states); 0 at goals."""
    values = np.zeros((steps + 1, game.n_states))
    chosen = np.flatnonzero(np.diff(game.row_start))  # states with actions
    if not len(chosen):
        return values
    for k in range(1, steps + 1):
        cells = game.reward + game.matrix @ values[k - 1]
        rows = np.minimum.reduceat(cells, game.cell_start[:-1])
        values[k, chosen] = np.maximum.reduceat(rows, game.row_start[:-1][chosen])
    return values
