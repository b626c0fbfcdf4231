"""End components, in which a play can stay for ever, and their mean rewards.

An end component is a set of cells whose outcomes stay in their states and connect them. When both
players cooperate to stay, the largest mean reward per step is the *gain* of a maximal end
component, the least g for which potentials h exist with

    g + h(s)  >=  r(c) + sum over s' of T(c, s') h(s')       for every cell c of state s

A game is strongly solvable only if every gain is negative: a play that never reaches a goal then
costs infinitely much. The gain is a linear program; its sign is proven by h, allowing for rounding.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cavsumo.games.model import Bools, Floats, Game, Ints

EPSILON = float(np.finfo(float).eps)


@dataclass(frozen=True, eq=False)
class EndComponent:
    """A maximal end component.

    Attributes:
        states: its states.
        cells: its cells.
    """

    states: Ints
    cells: Ints


@dataclass(frozen=True, eq=False)
class Gain:
    """The largest mean reward per step within an end component.

    Attributes:
        value: the gain.
        at_most: bound on it that holds in spite of rounding.
        cells: those used for ever by a play that earns it.
    """

    value: float
    at_most: float
    cells: Ints


def end_components(game: Game, kept: Bools | None = None) -> list[EndComponent]:
    """The maximal end components without goals, of all cells or of those kept."""
    labels, kept = _stable(game, kept)
    cells = np.flatnonzero(kept)
    label = labels[game.cell_state[cells]]
    order = np.argsort(label, kind="stable")
    cuts = np.flatnonzero(np.diff(label[order])) + 1
    parts = np.split(cells[order], cuts) if len(cells) else []
    found = [EndComponent(np.unique(game.cell_state[part]), part) for part in parts]
    return sorted(found, key=lambda component: int(component.states[0]))


def _stable(game: Game, kept: Bools | None) -> tuple[Ints, Bools]:
    """Strongly connected components and the cells that stay in theirs, once nothing changes."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    away = game.matrix @ game.goal.astype(float) == 0
    kept = away if kept is None else kept & away
    n = game.n_states
    entry_cell = np.repeat(np.arange(game.n_cells), np.diff(game.outcome_start))
    while True:
        used = kept[entry_cell]
        source, target = game.cell_state[entry_cell[used]], game.successor[used]
        graph = csr_matrix((np.ones(len(source), dtype=np.int8), (source, target)), shape=(n, n))
        _, labels = connected_components(graph, directed=True, connection="strong")
        leaves = np.zeros(game.n_cells, dtype=bool)
        leaves[entry_cell[used][labels[source] != labels[target]]] = True
        if not leaves.any():
            return labels, kept
        kept = kept & ~leaves


def gain(game: Game, component: EndComponent) -> Gain:
    """The largest mean reward per step within a maximal end component."""
    part, reward = _within(game, component)
    if len(component.states) == 1:
        best = int(np.argmax(reward))
        bound = float(reward[best]) + _reward_error(game, component.cells).max()
        return Gain(float(reward[best]), bound, component.cells[[best]])
    value, potential, used = _program(game, component, part, reward)
    moved = part @ potential + reward - potential[_own(game, component)]
    at_most = float(np.max(moved + _rounding(game, component, part, potential)))
    return Gain(value, at_most, component.cells[used])


def _within(game: Game, component: EndComponent) -> tuple[Any, Floats]:
    """The transition matrix and rewards of a component's cells."""
    part = game.matrix[component.cells][:, component.states]
    return part, game.reward[component.cells]


def _own(game: Game, component: EndComponent) -> Ints:
    """The place among the component's states of the state of each cell."""
    return np.searchsorted(component.states, game.cell_state[component.cells])


def _program(
    game: Game, component: EndComponent, part: Any, reward: Floats
) -> tuple[float, Floats, Ints]:
    """Gain, potentials and the cells in use, by linear programming."""
    from scipy.optimize import linprog
    from scipy.sparse import csr_matrix, hstack

    cells, states = part.shape
    own = csr_matrix((np.ones(cells), (np.arange(cells), _own(game, component))), part.shape)
    constraints = hstack([part - own, csr_matrix(-np.ones((cells, 1)))]).tocsr()
    bounds = [(0.0, 0.0)] + [(None, None)] * states  # potentials count from the first state
    cost = np.append(np.zeros(states), 1.0)
    found = linprog(cost, constraints, -reward, bounds=bounds, method="highs")
    if found.status != 0:  # not seen; then nothing is proven
        return float(reward.max()), np.zeros(states), np.array([int(np.argmax(reward))])
    return float(found.x[-1]), found.x[:-1], np.flatnonzero(-found.ineqlin.marginals > 1e-12)


def _reward_error(game: Game, cells: Ints) -> Floats:
    """Bound on the errors of the expected rewards of cells."""
    return 4.0 * EPSILON * game.magnitude[cells]


def _rounding(game: Game, component: EndComponent, part: Any, potential: Floats) -> Floats:
    """Bound on the error of the computed r + P h - h of each cell."""
    terms = part @ np.abs(potential) + np.abs(potential[_own(game, component)])
    terms = terms + np.abs(game.reward[component.cells])
    widest = int(np.diff(game.outcome_start).max())
    error: Floats = (2 * widest + 8) * EPSILON * terms + _reward_error(game, component.cells)
    return error
