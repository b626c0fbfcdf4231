"""Matrix games: the value and optimal mixed strategies of one simultaneous choice.

The row player maximises, the column player minimises. Where a pure pair is a saddle point the
answer is exact, 2 x 2 games have a closed form. Other small games are solved all at once by the
theorem of Shapley and Snow (1950): some square part of the matrix makes both players indifferent
and has optimal strategies. Larger games, and those for which rounding spoils this, are linear
programs (HiGHS).
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from cavsumo.games.model import Floats

TOLERANCE = 1e-10  # of the linear programs, the least that HiGHS takes
SMALL = 5  # rows and columns up to which square parts are tried


class Answers(NamedTuple):
    """Values and optimal strategies of k matrix games of the same shape.

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
        parts = _two_by_two(matrices[mixed]) if many == wide == 2 else _any_size(matrices[mixed])
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


def _any_size(matrices: Floats) -> Answers:
    """By square parts if these give the answer, else by linear programs."""
    if max(matrices.shape[1:]) > SMALL:
        return _programs(matrices)
    found, gap = _by_square_parts(matrices)
    span = matrices.max(axis=(1, 2)) - matrices.min(axis=(1, 2))
    blurred = np.flatnonzero(~(gap <= TOLERANCE * span))
    if len(blurred):
        for into, part in zip(found, _programs(matrices[blurred]), strict=True):
            into[blurred] = part
    return found


def _by_square_parts(matrices: Floats) -> tuple[Answers, Floats]:
    """The best strategies that a square part has, and the gap of their bounds: shape (k,)."""
    k, many, wide = matrices.shape
    found = Answers(np.zeros(k), np.zeros((k, many)), np.zeros((k, wide)))
    gap = np.full(k, np.inf)
    low = matrices.min(axis=(1, 2), keepdims=True)
    span = matrices.max(axis=(1, 2), keepdims=True) - low
    positive = (matrices - low) / span + 1.0  # then the part that has the strategies is regular
    for size in range(2, min(many, wide) + 1):
        for rows in itertools.combinations(range(many), size):
            for columns in itertools.combinations(range(wide), size):
                x, y = _indifferent(positive[:, rows][:, :, columns])
                full = np.zeros((k, many)), np.zeros((k, wide))
                full[0][:, rows], full[1][:, columns] = x, y
                least = np.einsum("ki,kij->kj", full[0], matrices).min(axis=1)
                most = np.einsum("kij,kj->ki", matrices, full[1]).max(axis=1)
                better = np.flatnonzero(most - least < gap)  # not where there is no answer: NaN
                gap[better] = (most - least)[better]
                found.rows[better], found.columns[better] = full[0][better], full[1][better]
    value = np.einsum("ki,kij,kj->k", found.rows, matrices, found.columns)
    return found._replace(value=value), gap


def _indifferent(parts: Floats) -> tuple[Floats, Floats]:
    """Weights of rows and of columns that make the other player indifferent; NaN where none do."""
    regular = np.abs(np.linalg.det(parts)) > 1e-12
    inverse = np.full_like(parts, np.nan)
    inverse[regular] = np.linalg.inv(parts[regular])
    x, y = inverse.sum(axis=1), inverse.sum(axis=2)
    with np.errstate(divide="ignore", invalid="ignore"):
        x, y = x / x.sum(axis=1, keepdims=True), y / y.sum(axis=1, keepdims=True)
    negative = (x < 0).any(axis=1) | (y < 0).any(axis=1)
    x[negative], y[negative] = np.nan, np.nan
    return x, y


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
    """Weights that are not negative and sum to 1; those within the tolerance of 0 are 0."""
    weights = np.where(weights > TOLERANCE, weights, 0.0)
    shares: Floats = weights / weights.sum()
    return shares
