"""Sums over outcomes, as in ``rises``, and linear systems x = b + P x with P in CSR form.

Gauss-Seidel sweeps, as in ``flow`` and ``pairs``.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def rises(start, successor, probability, reward, own, value):  # type: ignore[no-untyped-def]
    """r + sum of p (V(s') - V(own)) of each cell, and the sum of the terms without their signs."""
    rise, size = np.empty(len(reward)), np.empty(len(reward))
    for c in range(len(reward)):
        here, total, whole = value[own[c]], 0.0, 0.0
        for k in range(start[c], start[c + 1]):
            term = probability[k] * (value[successor[k]] - here)
            total += term
            whole += abs(term)
        rise[c] = total + reward[c]
        size[c] = whole + abs(reward[c])
    return rise, size


@njit(cache=True, nogil=True)
def forward(start, column, entry, right, leave):  # type: ignore[no-untyped-def]
    """x with x(s) = b(s) + sum of P(s, t) x(t) over t <= s; ``leave`` is 1 - P(s, s)."""
    x = np.empty(len(right))
    for s in range(len(right)):
        total = right[s]
        for k in range(start[s], start[s + 1]):
            if column[k] < s:
                total += entry[k] * x[column[k]]
        x[s] = total / leave[s]
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
