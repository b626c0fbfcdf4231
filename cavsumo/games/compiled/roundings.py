"""Advantages with bounds on their rounding errors, as in ``rounding``, in one pass."""

from __future__ import annotations

import numpy as np
from numba import njit

from cavsumo.games.components import EPSILON


@njit(cache=True, nogil=True)
def advantages_of(start, successor, probability, reward, magnitude, own, value, cells):  # type: ignore[no-untyped-def]
    """The advantages of some cells and bounds on their errors."""
    advantage, error = np.empty(len(cells)), np.empty(len(cells))
    for i, c in enumerate(cells):
        advantage[i], error[i] = _cell(
            c, start, successor, probability, reward, magnitude, own, value
        )
    return advantage, error


@njit(cache=True, nogil=True)
def noise_of(start, successor, probability, reward, magnitude, own, value, left, more):  # type: ignore[no-untyped-def]
    """The largest error of a relevant cell in each state."""
    most = np.zeros(len(value))
    for c in range(len(reward)):
        advantage, error = _cell(c, start, successor, probability, reward, magnitude, own, value)
        error = 4.0 * error
        if abs(advantage) <= 2.0 * (error + left):
            most[own[c]] = max(most[own[c]], error + more)
    return most


@njit(cache=True, nogil=True, inline="always")
def _cell(c, start, successor, probability, reward, magnitude, own, value):  # type: ignore[no-untyped-def]
    """The advantage of a cell and the bound on its error."""
    here, total, whole = value[own[c]], 0.0, 0.0
    for k in range(start[c], start[c + 1]):
        term = probability[k] * (value[successor[k]] - here)
        total += term
        whole += abs(term)
    size = (whole + abs(reward[c])) * (start[c + 1] - start[c] + 4)
    return total + reward[c], EPSILON * (size + 2.0 * magnitude[c])
