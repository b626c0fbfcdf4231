"""The expected cost to a goal in an MDP by Storm (stormpy 2), an independent solver."""

from __future__ import annotations

import tempfile
from pathlib import Path
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


def expected_cost(game: Game, cells: Any, *, least: bool) -> Any:
    """The least or largest expected cost -R to a goal from each state, choosing among cells.

    Args:
        cells: those that may be chosen, ascending; one player's policy is fixed by leaving out.
        least: whether the tester chooses, else the ego.
    """
    return costs(game, check(model(game, np.asarray(cells)), least=least))


def check(model: Any, *, least: bool, precision: float = 1e-6, method: str = "optimistic") -> Any:
    """Storm's result for a model, to an absolute precision."""
    formula = stormpy.parse_properties(f'R{"min" if least else "max"}=? [F "goal"]')[0]
    environment = stormpy.Environment()
    solver = environment.solver()
    solver.force_soundness = method != "plain"
    solver.min_max().method = METHODS[method]
    solver.min_max().precision = stormpy.Rational(precision)
    solver.min_max().relative_termination_criterion = False
    return stormpy.model_checking(model, formula, environment=environment)


def costs(game: Game, result: Any) -> Any:
    """The numbers of a result."""
    return np.array([result.get_value(s) for s in range(game.n_states)])


def model(game: Game, cells: Any) -> Any:
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


def ring(length: int) -> Any:
    """The MDP ``rings.one_pedestrian``, built by Storm from a text of the same rule."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "ring.prism")
        file.write_text(_text(length), encoding="utf-8")
        program = stormpy.parse_prism_program(str(file))
    return stormpy.build_model(program, stormpy.parse_properties('R{"cost"}min=? [F "goal"]'))


def _text(length: int) -> str:
    """``rings.one_pedestrian`` in the language of PRISM, which Storm reads."""
    lines = [
        "mdp",
        f"formula ahead = mod({length} - x, {length});",
        "formula braking = v=3 ? 3 : (v=2 ? 1 : 0);",
        "formula reached = y=2 & ahead > braking & ahead <= braking + v;",
        'label "goal" = reached;',
        f"module ring\n x : [0..{length - 1}] init 0; v : [1..3] init 1; y : [0..4] init 0;",
    ]
    prices = []
    for action in range(5):
        outcomes = [_outcome(length, action - 2, k) for k in range(9)]
        updates = " + ".join(update for update, _ in outcomes)
        lines.append(f" [move{action}] !reached -> {updates};")
        prices.append(f" [move{action}] true : {' + '.join(price for _, price in outcomes)};")
    ends = [" [stay] reached -> true;", "endmodule", 'rewards "cost"', *prices, "endrewards"]
    return "\n".join(lines + ends)


def _outcome(length: int, move: int, k: int) -> tuple[str, str]:
    """An update with its probability, and its part of the expected cost."""
    step = (move > 0) - (move < 0)
    chance = f"{(16, 3, 1)[k // 3]}/60"
    x = f"mod(x + v, {length})"
    v = f"max(1, min(3, v + {k % 3 - 1}))"
    y = f"max(0, min(4, y + {step * max(0, abs(move) - k // 3)}))"
    near = f"mod({2 * length} - x - v, {length})"
    late = f"({y} = 2 & {near} <= ({v}=3 ? 3 : ({v}=2 ? 1 : 0)))"
    update = f"{chance} : (x'={x}) & (v'={v}) & (y'={late} ? 0 : {y})"
    return update, f"{chance} * ({late} ? 25 : ({y} >= 1 & {y} <= 3 ? 2 : 1))"
