"""The expected cost to a goal in an MDP by Storm (stormpy 2), an independent solver."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import stormpy
from stormpy.developer import _core as core
from stormpy.developer import storage
from stormpy.developer.storage import _storage as double

from cavsumo.games.model import Game

METHODS = {
    "optimistic": core.MinMaxMethod.OPTIMISTIC_VALUE_ITERATION,
    "sound": core.MinMaxMethod.SOUND_VALUE_ITERATION,
    "plain": core.MinMaxMethod.VALUE_ITERATION,
}


def expected_cost(
    game: Game,
    cells: Any,
    *,
    least: bool,
    precision: float = 1e-6,
    method: str = "optimistic",
) -> tuple[Any, float]:
    """The least or largest expected cost -R to a goal, choosing among cells of a game.

    Args:
        cells: those that may be chosen, ascending; one player's policy is fixed by leaving out.
        least: whether the tester chooses, else the ego.
        precision: absolute.

    Returns:
        The cost from each state and the seconds that solving took, without building the model.
    """
    model = _model(game, np.asarray(cells))
    formula = stormpy.parse_properties(f'R{"min" if least else "max"}=? [F "goal"]')[0]
    environment = stormpy.Environment()
    solver = environment.solver()
    solver.force_soundness = method != "plain"
    solver.min_max().method = METHODS[method]
    solver.min_max().precision = stormpy.Rational(precision)
    solver.min_max().relative_termination_criterion = False
    begun = time.perf_counter()
    result = stormpy.model_checking(model, formula, environment=environment)
    seconds = time.perf_counter() - begun
    return np.array([result.get_value(s) for s in range(game.n_states)]), seconds


def _model(game: Game, cells: Any) -> Any:
    """Those cells as an MDP; goals stay where they are at no cost."""
    state = game.cell_state[cells]
    builder = double._SparseMatrixBuilder_Double(
        force_dimensions=False, has_custom_row_grouping=True
    )
    cost, row = [], 0
    starts = np.searchsorted(state, np.arange(game.n_states + 1))
    for s in range(game.n_states):
        builder.new_row_group(row)
        if game.goal[s]:
            builder.add_next_value(row, s, 1.0)
            cost.append(0.0)
            row += 1
        for cell in cells[starts[s] : starts[s + 1]]:
            for successor, p, _ in sorted(game.outcomes(cell)):
                builder.add_next_value(row, successor, p)
            cost.append(-float(game.reward[cell]))
            row += 1
    labels = storage.StateLabeling(game.n_states)
    labels.add_label("goal")
    for s in np.flatnonzero(game.goal).tolist():
        labels.add_label_to_state("goal", s)
    rewards = double._SparseRewardModel_Double(optional_state_action_reward_vector=cost)
    parts = double._SparseModelComponents_Double(builder.build(), labels, {"cost": rewards})
    return double._SparseMdp_Double(parts)
