"""Sums over outcomes, as in ``advantages``, and linear systems x = b + P x with P in CSR form.

Gauss-Seidel sweeps, as in ``flow`` and ``pairs``.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def advantages(start, successor, probability, reward, own, value):  # type: ignore[no-untyped-def]
    """r + sum of p (V(s') - V(own)) of each cell, and the sum of the terms without their signs."""
    advantage, size = np.empty(len(reward)), np.empty(len(reward))
    for c in range(len(reward)):
        here, total, whole = value[own[c]], 0.0, 0.0
        for k in range(start[c], start[c + 1]):
            term = probability[k] * (value[successor[k]] - here)
            total += term
            whole += abs(term)
        advantage[c] = total + reward[c]
        size[c] = whole + abs(reward[c])
    return advantage, size


@njit(cache=True, nogil=True, error_model="numpy")
def bicgstab(start, column, entry, right, enough, iterations):  # type: ignore[no-untyped-def]
    """x with |b + P x - x| <= enough in the 2-norm, or the last of the iterations; may be NaN.

    BiCGSTAB with one Gauss-Seidel sweep as preconditioner (van der Vorst 1992, SIAM J. Sci. Stat.
    Comput. 13), as scipy's, in one thread and without its temporary arrays.
    """
    x, p, v = np.zeros_like(right), np.zeros_like(right), np.zeros_like(right)
    left, shadow = right.copy(), right.copy()
    rho = alpha = omega = 1.0
    for _ in range(iterations):
        if np.sqrt(_dot(left, left)) <= enough:
            break
        before, rho = rho, _dot(shadow, left)
        p = left + (rho / before) * (alpha / omega) * (p - omega * v)
        step = _forward(start, column, entry, p)
        v = _lost(start, column, entry, step)
        alpha = rho / _dot(shadow, v)
        x += alpha * step
        left = left - alpha * v
        if np.sqrt(_dot(left, left)) <= enough:
            break
        step = _forward(start, column, entry, left)
        t = _lost(start, column, entry, step)
        omega = _dot(t, left) / _dot(t, t)
        x += omega * step
        left = left - omega * t
    return x


@njit(cache=True, nogil=True)
def _dot(a, b):  # type: ignore[no-untyped-def]
    """The scalar product; BLAS would bring threads of its own."""
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


@njit(cache=True, nogil=True)
def _lost(start, column, entry, x):  # type: ignore[no-untyped-def]
    """x - P x."""
    y = np.empty_like(x)
    for s in range(len(x)):
        total = x[s]
        for k in range(start[s], start[s + 1]):
            total -= entry[k] * x[column[k]]
        y[s] = total
    return y


@njit(cache=True, nogil=True, error_model="numpy")
def _forward(start, column, entry, right):  # type: ignore[no-untyped-def]
    """x with x(s) = b(s) + sum of P(s, t) x(t) over t <= s."""
    x = np.empty_like(right)
    for s in range(len(right)):
        total, leave = right[s], 1.0
        for k in range(start[s], start[s + 1]):
            if column[k] < s:
                total += entry[k] * x[column[k]]
            elif column[k] == s:
                leave -= entry[k]
        x[s] = total / leave
    return x


@njit(cache=True, nogil=True)
def reached(start, column, entry, order, sweeps):  # type: ignore[no-untyped-def]
    """The sum of x after Gauss-Seidel sweeps of x = 1 + P x from 0 in an order."""
    x = np.zeros(len(start) - 1)
    for _ in range(sweeps):
        for s in order:
            total, leave = 1.0, 1.0
            for k in range(start[s], start[s + 1]):
                if column[k] == s:
                    leave -= entry[k]
                else:
                    total += entry[k] * x[column[k]]
            if leave <= 0.0:
                return -math.inf
            x[s] = total / leave
    return x.sum()
