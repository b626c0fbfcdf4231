"""Post-encroachment time: how long after one body left a place the other came there."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cavsumo.assertions.metrics.plane import ttc_boxes

Numbers = NDArray[np.float64]
CHUNK = 256  # pairs that are looked at together


def pet(first_leaves_t: ArrayLike, second_enters_t: ArrayLike) -> Numbers:
    """Post-encroachment time, negative for an overlap (Allen, Shin and Cooper 1978) [s]."""
    return np.subtract(second_enters_t, first_leaves_t, dtype=np.float64)


def pet_tracks(times: ArrayLike, first: ArrayLike, second: ArrayLike) -> float:
    """Post-encroachment time of two tracks of boxes [s]; infinite if they share no place.

    The shortest time between the one's being at a place and the other's coming there, over all
    places: the smallest |t_i - t_j| for which the first box at t_i overlaps the second at t_j. It
    is 0 for bodies that touch, and exact to a timestep. Where two ways cross it is the time between
    the first one's leaving and the second one's entering the area that both sweep.

    Args:
        times: shape (n,), increasing [s].
        first, second: shape (n, 5): x, y [m], heading [rad], length, width [m].
    """
    t, a, b = (np.asarray(values, float) for values in (times, first, second))
    best = math.inf
    reach = (np.hypot(a[:, 3], a[:, 4]).max() + np.hypot(b[:, 3], b[:, 4]).max()) / 2.0
    apart = np.hypot(a[:, None, 0] - b[None, :, 0], a[:, None, 1] - b[None, :, 1])
    pairs = np.argwhere(apart <= reach)
    if not len(pairs):
        return best
    spans = np.abs(t[pairs[:, 0]] - t[pairs[:, 1]])
    order = np.argsort(spans, kind="stable")
    for chunk in np.array_split(order, max(1, len(order) // CHUNK)):
        i, j = pairs[chunk, 0], pairs[chunk, 1]
        touching = boxes_overlap(a[i], b[j])
        if touching.any():
            return float(spans[chunk][touching].min())
    return best


def boxes_overlap(first: Numbers, second: Numbers) -> NDArray[np.bool_]:
    """Whether boxes overlap or touch, pair by pair; shape (n, 5) each."""
    still = np.zeros((len(first), 2))
    return np.equal(ttc_boxes(first, still, second, still), 0.0)
