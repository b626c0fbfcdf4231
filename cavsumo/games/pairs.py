"""The value of one pair of policies: a linear system (I - P) V = r, solved to a given residual.

Small systems by a sparse factorisation, large ones by BiCGSTAB preconditioned with one
Gauss-Seidel sweep, which in the arena's order carries news from the goals through the game.
A pair that never reaches a goal from somewhere has a singular system: then nothing is returned.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from cavsumo.games.model import Floats

DIRECT = 1500  # states up to which systems are factorised
FALLBACK = 5000  # states up to which they are where the iteration fails
ROUNDS, ITERATIONS = 4, 80


def pair_value(
    transitions: Any, reward: Floats, start: Floats, residual: float, precise: bool = True
) -> Floats | None:
    """V with |r + P V - V| <= residual in every state, or the best that can be had.

    Args:
        transitions: P as CSR, square.
        reward: r.
        start: a guess.
        residual: wanted, absolute.
        precise: otherwise a hundredth of the guess's residual will do.

    Returns:
        None when the system seems singular.
    """
    from scipy.sparse import identity

    system = (identity(len(reward), format="csr") - transitions).tocsr()
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")  # singular systems are answered below
        try:
            if len(reward) > DIRECT:
                found = _refined(system, reward, start, residual, precise, _krylov(system))
                if found is not None or len(reward) > FALLBACK:
                    return found
            return _refined(system, reward, start, residual, precise, _factorised(system))
        except RuntimeError:  # SuperLU: exactly singular
            return None


def _refined(
    system: Any, reward: Floats, start: Floats, residual: float, precise: bool, solve: Any
) -> Floats | None:
    """Corrections until the residual is small or does not shrink any more."""
    value, left = start, reward - system @ start
    size = float(np.abs(left).max(initial=0.0))
    first, wanted = size, residual if precise else max(residual, 1e-2 * size)
    for attempt in range(ROUNDS):
        if size <= wanted:
            break
        corrected = value + solve(left, 0.3**attempt * wanted)
        left_now = reward - system @ corrected
        size_now = float(np.abs(left_now).max())
        if not size_now < 0.9 * size:
            break
        value, left, size = corrected, left_now, size_now
    noise = 16.0 * np.finfo(float).eps * float(np.abs(value).max(initial=0.0))
    return value if size <= max(wanted, noise, 0.2 * first) else None


def _factorised(system: Any) -> Any:
    from scipy.sparse.linalg import splu

    factors = splu(system.tocsc())
    return lambda left, _: factors.solve(left)


def _krylov(system: Any) -> Any:
    from scipy.sparse import tril
    from scipy.sparse.linalg import LinearOperator, bicgstab, splu

    triangle = splu(tril(system, format="csc"), permc_spec="NATURAL", diag_pivot_thresh=0.0)
    sweep = LinearOperator(system.shape, triangle.solve)
    norm = 0.3 * np.sqrt(system.shape[0])  # of a vector whose entries are all about 0.3

    def solve(left: Floats, wanted: float) -> Floats:
        enough = min(norm * wanted, 0.05 * float(np.linalg.norm(left)))
        found: Floats
        found, _ = bicgstab(system, left, rtol=0.0, atol=enough, maxiter=ITERATIONS, M=sweep)
        return found

    return solve
