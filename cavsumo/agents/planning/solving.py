"""The best response, solved: a chain where the body cannot stop any more, before that a game."""

from __future__ import annotations

from typing import Any

import numpy as np

from cavsumo.agents.planning.grid import (
    CLASSES,
    SPEEDS,
    ZETAS,
    Floats,
    Grid,
    Ints,
    States,
    braking,
    corners,
    grid_for,
    scale,
)
from cavsumo.agents.planning.moves import (
    STAND,
    WALK,
    Aim,
    move,
)
from cavsumo.agents.planning.opponent import Counts
from cavsumo.agents.planning.response import (
    NEGLIGIBLE,
    PRECISION,
    Counted,
    Plan,
    counted,
    deciding,
)
from cavsumo.games import Game, from_arrays, solve

ROLLOUTS = 40
MOVES = (STAND, WALK)  # while the body can still stop


def best_response(counts: Counts, dt: float, aim: Aim) -> Plan:
    """Solve against the counted ego; ``dt`` is the timestep of the model [s]."""
    plan = unsolved(counts, dt, aim)
    grid = plan.grid
    if aim.confidence is None:
        roll_out(plan)
    else:
        chain(plan)
    first = (grid.committed + 1 + grid.inside) * grid.layer
    plan.value[first:] = solve(response_game(plan), precision=PRECISION).lower[:-1]
    return plan


def unsolved(counts: Counts, dt: float, aim: Aim) -> Plan:
    """The plan for counts, all values 0."""
    grid = grid_for(counts, dt)
    return Plan(grid, aim, counted(counts, grid, aim.confidence), np.zeros(grid.size))


def chain(plan: Plan) -> None:
    """Back up the values of the body that cannot stop any more, from the strip to the kerb.

    The grid adds an interpolation error in the strip; for sets of egos there is no exact
    alternative.
    """
    grid = plan.grid
    for entry in range(-grid.inside, grid.committed + 1):
        states, which = layer(grid, entry)
        action = np.full(len(which), WALK)
        backup = plan.back_up(states, action, plan.model.middles[which], which)
        plan.value[_slice(grid, entry)] = backup.worth


def roll_out(plan: Plan) -> None:
    """Values of the body that cannot stop any more by simulation, without interpolation errors.

    Of the last two entries only, as no decision leads beyond them. The standard error of a value is
    at most half the largest price by the root of ROLLOUTS; always the same random numbers.
    """
    for entry in (plan.grid.committed - 1, plan.grid.committed):
        states, which = layer(plan.grid, entry)
        rng = np.random.default_rng(0)
        worth = sum(_played(plan, states, which, rng) for _ in range(ROLLOUTS)) / ROLLOUTS
        plan.value[_slice(plan.grid, entry)] = worth


def _played(plan: Plan, states: States, which: Ints, rng: np.random.Generator) -> Floats:
    """The reward of one walk into the strip from each state, all with the same random numbers."""
    grid, model = plan.grid, plan.model
    worth, left, alive = np.zeros(len(which)), np.ones(len(which)), np.arange(len(which))
    a = model.middles[which]
    for _ in range(int(states.entry[0]) + grid.inside + 1):
        decides, chances = deciding(states, model, grid.dt)
        anew = rng.random() < decides
        drawn = (rng.random() > np.cumsum(chances, axis=1)).sum(axis=1).clip(max=CLASSES - 1)
        a, held = np.where(anew, model.middles[drawn], a), np.where(anew, 0, states.held + 1)
        moved = move(states, np.full(len(alive), WALK), a, held, grid, plan.aim)
        worth[alive] -= left * moved.price
        left = left * (1.0 - moved.over)
        some = left > NEGLIGIBLE
        alive, a, left = alive[some], a[some], left[some]
        states = _some(moved.states, some)
        if not len(alive):
            break
    return worth


def _slice(grid: Grid, entry: int) -> slice:
    """The slice of the states with an entry."""
    return slice((entry + grid.inside) * grid.layer, (entry + grid.inside + 1) * grid.layer)


def layer(grid: Grid, entry: int) -> tuple[States, Ints]:
    """All states with an entry, in order, and the class of each."""
    z, s, held, which = np.indices(grid.shape[1:]).reshape(4, -1)
    v = SPEEDS[s]
    left = braking(v) + ZETAS[z] * scale(v)
    gap = left + v * max(entry, 0) * grid.dt
    return States(np.full(len(v), float(entry)), gap, v, held), which


def response_game(plan: Plan) -> Game:
    """The game while the body can still stop; its last state, the goal, is the end of that.

    The expected value of the committed body (``plan.value``) is the reward of going there. Player 2
    has one action for each class on which the ego may put the remaining probability, else one.
    """
    from scipy.sparse import csr_matrix

    grid = plan.grid
    first = grid.committed + 1
    layers = [layer(grid, entry) for entry in range(first, grid.before + 1)]
    states = States(
        np.concatenate([s.entry for s, _ in layers]),
        np.concatenate([s.gap for s, _ in layers]),
        np.concatenate([s.v for s, _ in layers]),
        np.concatenate([s.held for s, _ in layers]),
    )
    which = np.concatenate([w for _, w in layers])
    rows = _some(states, np.repeat(np.arange(len(which)), len(MOVES)))
    action = np.tile(MOVES, len(which))
    cell_row, weights = _cells(rows, plan.model, grid.dt)
    outcomes, price = csr_matrix((len(cell_row), len(which) + 1)), np.zeros(len(cell_row))
    for k in range(-1, CLASSES):
        cells = np.flatnonzero(weights[:, k + 1])
        used, back = np.unique(cell_row[cells], return_inverse=True)
        taken = np.repeat(which, len(MOVES))[used] if k < 0 else np.full(len(used), k)
        places, shares, costs = _branch(plan, _some(rows, used), action[used], k, taken)
        share = weights[cells, k + 1]
        data = (shares[:, back] * share).ravel()
        owner = np.broadcast_to(cells, (len(shares), len(cells))).ravel()
        outcomes += csr_matrix((data, (owner, places[:, back].ravel())), shape=outcomes.shape)
        price[cells] += share * costs[back]
    outcomes.sum_duplicates()
    outcomes.eliminate_zeros()
    return from_arrays(
        goal=np.arange(len(which) + 1) == len(which),
        row_start=np.append(np.arange(len(which) + 1) * len(MOVES), len(action)),
        cell_start=np.searchsorted(cell_row, np.arange(len(action) + 1)),
        outcome_start=outcomes.indptr,
        successor=outcomes.indices,
        probability=outcomes.data,
        reward=-price,
        tester_action=action,
        name="best response",
    )


def _some(states: States, places: Any) -> States:
    """Some of the states."""
    return States(*(column[places] for column in states))


def _branch(
    plan: Plan, states: States, action: Ints, k: int, which: Ints
) -> tuple[Ints, Floats, Floats]:
    """Successors in the game and their shares, both (9, n), and the mean price of the ends.

    Class -1 is that the ego keeps its acceleration; ``which``: the class that it has then.
    """
    held = states.held + 1 if k < 0 else np.zeros_like(states.held)
    moved = move(states, action, plan.model.middles[which], held, plan.grid, plan.aim)
    places, shares = corners(moved.states, which, plan.grid)
    shares = shares * (1.0 - moved.over)
    offset = plan.grid.layer * (plan.grid.committed + 1 + plan.grid.inside)
    committed = places < offset
    price = moved.price - (shares * committed * plan.value[places]).sum(axis=0)
    end = plan.grid.size - offset
    places = np.vstack([np.where(committed, end, places - offset), np.full((1, len(action)), end)])
    return places, np.vstack([shares, moved.over[None]]), price


def _cells(rows: States, model: Counted, dt: float) -> tuple[Ints, Floats]:
    """The row of each cell, and the probabilities of its branches, shape (cells, 1 + classes)."""
    decides, chances = deciding(rows, model, dt)
    rest = np.where(decides > 0.0, 1.0 - chances.sum(axis=1), 0.0)
    bent = rest > 1e-9
    cell_row = np.repeat(np.arange(len(decides)), np.where(bent, CLASSES, 1))
    start = np.searchsorted(cell_row, np.arange(len(decides)))
    order = np.arange(len(cell_row)) - start[cell_row]
    taken = chances[cell_row]
    taken[np.arange(len(cell_row)), order] += np.where(bent, rest, 0.0)[cell_row]
    share = decides[cell_row, None]
    return cell_row, np.hstack([1.0 - share, share * taken])
