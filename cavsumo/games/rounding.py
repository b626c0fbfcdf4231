"""Bounds on the rounding errors of advantages, for the checks of a certificate.

A sum of k products is wrong by at most k half-units of the last place of its terms (half of epsilon
each), every term by three (p, the difference, the product), and probabilities that do not exactly
sum to 1 add k more. ``Game.magnitude`` bounds the error of the reward.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cavsumo.games.advantages import advantages
from cavsumo.games.components import EPSILON
from cavsumo.games.model import Floats, Game, Ints
from cavsumo.games.segments import gathered


def advantages_of(game: Game, value: Floats, cells: Ints) -> tuple[Floats, Floats]:
    """The advantages q(c) - V(s) of some cells, and bounds on their rounding errors.

    Args:
        value: V of each state; -inf, which no cell of a policy leads to, counts as 0.
        cells: those asked for; a policy uses few.
    """
    finite = np.where(np.isfinite(value), value, 0.0)
    if game.fast:
        from cavsumo.games.compiled import roundings

        found: tuple[Floats, Floats] = roundings.advantages_of(*_parts(game), finite, cells)
        return found
    start, successor, probability, reward, magnitude, own = _parts(game)
    same = np.arange(game.n_states)
    outcomes = gathered(start, successor, probability, cells, same, fast=False)
    return _advantages(*outcomes, reward[cells], magnitude[cells], own[cells], finite)


def noise_of(game: Game, value: Floats, left: float, more: float) -> Floats:
    """For each state a generous bound on the error of an advantage that is exactly 0.

    Most relevant cells lead to states of nearly the same value; only the others, such as an
    accident with a large loss, have an error above a unit of the last place.

    Args:
        value: nearly V, finite.
        left: a bound on the advantages of the relevant cells; infinite: every cell is relevant.
        more: added to the error of each cell.
    """
    if game.fast:
        from cavsumo.games.compiled import roundings

        compiled: Floats = roundings.noise_of(*_parts(game), value, left, more)
        return compiled
    advantage, error = _advantages(*_parts(game), value)
    error *= 4.0
    near = np.flatnonzero(np.abs(advantage) <= 2.0 * (error + left))
    most = np.zeros(game.n_states)
    np.maximum.at(most, game.cell_state[near], error[near] + more)
    return most


def _parts(game: Game) -> tuple[Ints, Any, Floats, Floats, Floats, Ints]:
    """The outcomes, and of each cell its reward, the magnitude of that and its state."""
    of_cells = game.reward, game.magnitude, game.cell_state
    return game.outcome_start, game.successor, game.probability, *of_cells


def _advantages(
    start: Ints,
    successor: Any,
    probability: Floats,
    reward: Floats,
    magnitude: Floats,
    own: Ints,
    value: Floats,
) -> tuple[Floats, Floats]:
    """The advantages of all cells given and bounds on their errors."""
    parts = (start, successor, probability, reward, own, value)
    advantage, size = advantages(*parts, fast=False)
    size *= np.diff(start) + 4
    size += 2.0 * magnitude
    return advantage, EPSILON * size
