"""Matrix games: the value and optimal mixed strategies of one simultaneous choice.

The row player maximises, the column player minimises. Where a pure pair is a saddle point the
answer is exact, 2 x 2 games have a closed form, larger ones are linear programs (HiGHS).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cavsumo.games.model import Floats

TOLERANCE = 1e-10  # of the linear programs, the least that HiGHS takes


class Answers(NamedTuple):
    """What to play in each of k matrix games of the same shape.

    Attributes:
        value: shape (k,).
        rows: the maximiser's weights, shape (k, R).
        columns: the minimiser's weights, shape (k, C).
    """

    value: Floats
    rows: Floats
    columns: Floats


def solve(matrices: Floats) -> Answers:
    """Values and strategies of k matrix games, shape (k, R, C)."""
    k, many, wide = matrices.shape
    safe, risk = matrices.min(axis=2), matrices.max(axis=1)
    row, column = safe.argmax(axis=1), risk.argmin(axis=1)
    each = np.arange(k)
    found = Answers(safe[each, row], np.zeros((k, many)), np.zeros((k, wide)))
    found.rows[each, row] = 1.0
    found.columns[each, column] = 1.0
    mixed = np.flatnonzero(found.value < risk[each, column])
    if len(mixed):
        parts = _two_by_two(matrices[mixed]) if many == wide == 2 else _programs(matrices[mixed])
        for into, part in zip(found, parts, strict=True):
            into[mixed] = part
    return found


def _two_by_two(m: Floats) -> Answers:
    """Games without a saddle point: both players make the other indifferent."""
    a, b, c, d = m[:, 0, 0], m[:, 0, 1], m[:, 1, 0], m[:, 1, 1]
    across, up = (a - b) + (d - c), np.stack([d - c, a - b], axis=1)
    left = np.stack([d - b, a - c], axis=1)
    rows, columns = up / across[:, None], left / across[:, None]
    value = np.einsum("ki,kij,kj->k", rows, m, columns)
    return Answers(value, rows, columns)


def _programs(matrices: Floats) -> Answers:
    """One by one, as linear programs."""
    solved = [_program(matrix) for matrix in matrices]
    return Answers(*(np.array(part) for part in zip(*solved, strict=True)))


def _program(matrix: Floats) -> tuple[float, Floats, Floats]:
    """maximise v with  sum over i of x_i m_ij >= v,  x a distribution; the duals are y."""
    from scipy.optimize import linprog

    many, wide = matrix.shape
    low, high = float(matrix.min()), float(matrix.max())
    scaled = (matrix - low) / (high - low)
    found = linprog(
        np.append(np.zeros(many), -1.0),
        A_ub=np.hstack([-scaled.T, np.ones((wide, 1))]),
        b_ub=np.zeros(wide),
        A_eq=np.append(np.ones(many), 0.0)[None, :],
        b_eq=[1.0],
        bounds=[(0.0, None)] * many + [(None, None)],
        method="highs",
        options={
            "primal_feasibility_tolerance": TOLERANCE,
            "dual_feasibility_tolerance": TOLERANCE,
        },
    )
    rows, columns = _distribution(found.x[:many]), _distribution(-found.ineqlin.marginals)
    return float(rows @ matrix @ columns), rows, columns


def _distribution(weights: Floats) -> Floats:
    """Weights that are not negative and sum to 1."""
    weights = np.maximum(weights, 0.0)
    shares: Floats = weights / weights.sum()
    return shares
