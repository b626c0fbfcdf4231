"""The value of one proper pair of policies: a linear system (I - P) V = r.

Small systems by a sparse factorisation, large ones by BiCGSTAB preconditioned with one
Gauss-Seidel sweep, which in the arena's order propagates values from the goals through the game.
I - P is regular because a goal is reached from every state (``reach``). The accuracy of a value
follows from the rewards and the expected number of steps t, (I - P) t = 1: |V| is at most the
largest reward times t, and its rounding error is in proportion to that bound.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from cavsumo.games.advantages import advantages
from cavsumo.games.components import EPSILON
from cavsumo.games.model import Floats

DIRECT = 1500  # states up to which systems are factorised
FALLBACK = 5000  # states up to which they are where the iteration fails
ROUNDS, ITERATIONS = 4, 80
STEPS_OFF = 0.5  # by which (I - P) t may miss 1; then t / (1 - 0.5) bounds the expected steps


def pair_value(
    transitions: Any,
    reward: Floats,
    start: Floats,
    residual: float,
    *,
    precise: bool = True,
    fast: bool = False,
    steps: Floats | None = None,
) -> Floats | None:
    """V with |r + P V - V| <= residual in every state, or as close as floats allow.

    Args:
        transitions: P as CSR, square; the last state can be reached from every other.
        reward: r.
        start: a guess.
        residual: wanted, absolute.
        precise: otherwise a hundredth of the guess's residual will do.
        fast: by compiled loops.
        steps: nearly the expected numbers of steps, if they are known of a pair like this one.

    Returns:
        None when no such value was found.
    """
    pair = _Pair(transitions, reward, fast)
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")  # an inaccurate value is not returned
        if len(reward) > DIRECT:
            found = _refined(pair, start, residual, precise, _krylov(pair), steps)
            if found is not None or len(reward) > FALLBACK:
                return found
        try:
            return _refined(pair, start, residual, precise, _factorised(pair), steps)
        except RuntimeError:  # probabilities so near to 1 that rounding makes the system singular
            return None


@dataclass(frozen=True)
class _Pair:
    """P and r, to be solved by compiled loops or not."""

    transitions: Any
    reward: Floats
    fast: bool

    def advantage(self, value: Floats) -> Floats:
        """r + P V - V."""
        p = self.transitions
        states = np.arange(len(value))
        return advantages(p.indptr, p.indices, p.data, self.reward, states, value, self.fast)[0]

    @cached_property
    def system(self) -> Any:
        """I - P."""
        from scipy.sparse import identity

        return (identity(len(self.reward), format="csr") - self.transitions).tocsr()


def _refined(
    pair: _Pair, start: Floats, residual: float, precise: bool, solve: Any, steps: Floats | None
) -> Floats | None:
    """Corrections until the residual is small or does not shrink any more; then it is judged."""
    value, left = start, pair.advantage(start)
    size = float(np.abs(left).max(initial=0.0))
    first, wanted = size, residual if precise else max(residual, 1e-2 * size)
    for attempt in range(ROUNDS):
        if size <= max(wanted, coarseness(value)):
            break
        corrected = value + solve(left, 0.3**attempt * wanted)
        left_now = pair.advantage(corrected)
        size_now = float(np.abs(left_now).max())
        if not size_now < 0.9 * size:
            break
        value, left, size = corrected, left_now, size_now
    if size <= wanted:
        return value
    most = _largest_value(pair, solve, steps)
    if not np.abs(value).max(initial=0.0) <= 2.0 * most:
        return None
    return value if size <= max(8.0 * EPSILON * most, 0.2 * first) else None


def _largest_value(pair: _Pair, solve: Any, steps: Floats | None) -> float:
    """The largest reward times the largest expected number of steps; 0 where that is not found."""
    ones = np.append(np.ones(len(pair.reward) - 1), 0.0)
    counting = _Pair(pair.transitions, ones, pair.fast)
    if steps is None or not _bounds_steps(counting, steps):
        steps = ones + solve(counting.advantage(ones), 0.2 * STEPS_OFF)
        if not _bounds_steps(counting, steps):
            return 0.0
    most = np.abs(pair.reward).max(initial=0.0) * steps.max(initial=0.0)
    return float(most) / (1.0 - STEPS_OFF)


def _bounds_steps(counting: _Pair, steps: Floats) -> bool:
    """Whether (I - P) t is 1 but for ``STEPS_OFF`` in every state, and t not negative."""
    off = float(np.abs(counting.advantage(steps)).max(initial=0.0))
    return off <= STEPS_OFF and bool(steps.min(initial=0.0) >= 0.0)


def coarseness(value: Floats) -> float:
    """Bound on the change of an advantage by rounding V to floats: a unit of its last place."""
    return float(np.spacing(np.abs(value).max(initial=0.0)))


def _factorised(pair: _Pair) -> Any:
    from scipy.sparse.linalg import splu

    factors = splu(pair.system.tocsc())
    return lambda left, _: factors.solve(left)


def _krylov(pair: _Pair) -> Any:
    """BiCGSTAB with a Gauss-Seidel sweep as preconditioner."""
    iterate = _compiled(pair) if pair.fast else _by_scipy(pair)
    norm = 0.3 * np.sqrt(len(pair.reward))  # of a vector whose entries are all about 0.3

    def solve(left: Floats, wanted: float) -> Floats:
        found: Floats = iterate(left, min(norm * wanted, 0.05 * float(np.sqrt((left**2).sum()))))
        return found

    return solve


def _compiled(pair: _Pair) -> Any:
    from cavsumo.games.compiled import systems

    p = pair.transitions
    return lambda left, enough: systems.bicgstab(
        p.indptr, p.indices, p.data, left, enough, ITERATIONS
    )


def _by_scipy(pair: _Pair) -> Any:
    from scipy.sparse import tril
    from scipy.sparse.linalg import LinearOperator, bicgstab, splu

    triangle = tril(pair.system, format="csc")
    factors = splu(triangle, permc_spec="NATURAL", diag_pivot_thresh=0.0)
    sweep = LinearOperator(triangle.shape, factors.solve)
    return lambda left, enough: bicgstab(
        pair.system, left, rtol=0.0, atol=enough, maxiter=ITERATIONS, M=sweep
    )[0]
