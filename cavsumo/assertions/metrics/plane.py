"""Two bodies anywhere on the plane: time to collision, deceleration, closest approach.

Bodies are boxes or discs that keep their velocity and do not turn. Arrays of boxes have the shape
(..., 5): x, y [m], heading [rad], length, width [m]; velocities (..., 2) [m/s]. Leading shapes
broadcast.
"""

from __future__ import annotations

from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

Numbers = NDArray[np.float64]


def ttc_2d_discs(
    p1: ArrayLike, v1: ArrayLike, r1: ArrayLike, p2: ArrayLike, v2: ArrayLike, r2: ArrayLike
) -> Numbers:
    """Time until two discs touch, infinite if they never do, 0 if they overlap [s].

    Args:
        p1, p2: centres, shape (..., 2) [m].
        v1, v2: velocities, shape (..., 2) [m/s].
        r1, r2: radii [m].
    """
    apart = np.asarray(p2, float) - np.asarray(p1, float)
    moving = np.asarray(v2, float) - np.asarray(v1, float)
    reach = np.asarray(r1, float) + np.asarray(r2, float)
    speed2, along = _dot(moving, moving), _dot(apart, moving)
    excess = _dot(apart, apart) - reach**2
    root = along**2 - speed2 * excess
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        # excess / (-along + sqrt(...)) is the first root without cancellation.
        time = excess / (-along + np.sqrt(root))
    meet = (root >= 0.0) & (along < 0.0)
    return cast(Numbers, np.where(excess <= 0.0, 0.0, np.where(meet, time, np.inf)))


def ttc_boxes(first: ArrayLike, v1: ArrayLike, second: ArrayLike, v2: ArrayLike) -> Numbers:
    """Time until two boxes touch, infinite if they never do, 0 if they overlap [s].

    Separating axes: the projections of two boxes on one of the directions of their sides overlap
    during an interval of time; the boxes overlap in the intersection of all four intervals.
    """
    enter, leave = _overlap(first, v1, second, v2)
    begin = np.maximum(0.0, np.max(enter, axis=-1))
    return cast(Numbers, np.where(begin <= np.min(leave, axis=-1), begin, np.inf))


def drac_boxes(first: ArrayLike, v1: ArrayLike, second: ArrayLike, v2: ArrayLike) -> Numbers:
    """Deceleration by which the first box just avoids the second: dv / (2 TTC) [m/s2].

    dv is the closing speed along the first one's heading. For a vehicle straight behind another
    this is (v_follow - v_lead)^2 / (2 gap); for a crossing course it is v^2 / (2 s), which stops
    the vehicle at the distance s ahead where they would touch. 0 if they do not close in, infinite
    if they touch.
    """
    return drac_at(first, v1, v2, ttc_boxes(first, v1, second, v2))


def drac_at(first: ArrayLike, v1: ArrayLike, v2: ArrayLike, ttc: ArrayLike) -> Numbers:
    """``drac_boxes`` for a known time to collision [m/s2]."""
    heading, time = np.asarray(first, float)[..., 2], np.asarray(ttc, float)
    ahead = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    closing = _dot(np.asarray(v1, float) - np.asarray(v2, float), ahead)
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        needed = closing / (2.0 * time)
    needed = np.where(closing > 0.0, needed, 0.0)
    return np.where((closing > 0.0) & (time == 0.0), np.inf, needed)


def closest_approach(
    p1: ArrayLike, v1: ArrayLike, p2: ArrayLike, v2: ArrayLike
) -> tuple[Numbers, Numbers]:
    """Time and distance of the closest approach of two points that keep their velocity [s, m]."""
    apart = np.asarray(p2, float) - np.asarray(p1, float)
    moving = np.asarray(v2, float) - np.asarray(v1, float)
    speed2 = _dot(moving, moving)
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        time = np.where(speed2 > 0.0, np.maximum(0.0, -_dot(apart, moving) / speed2), 0.0)
    there = apart + moving * time[..., None]
    return time, np.sqrt(_dot(there, there))


def _overlap(
    first: ArrayLike, v1: ArrayLike, second: ArrayLike, v2: ArrayLike
) -> tuple[Numbers, Numbers]:
    """When the projections on the four directions of their sides begin and cease to overlap [s]."""
    a, b = np.broadcast_arrays(np.asarray(first, float), np.asarray(second, float))
    apart, moving = b[..., :2] - a[..., :2], np.asarray(v2, float) - np.asarray(v1, float)
    axes = np.concatenate([_sides(a[..., 2]), _sides(b[..., 2])], axis=-2)  # (..., 4, 2)
    reach = _shadow(a, axes) + _shadow(b, axes)
    where = np.einsum("...ij,...j->...i", axes, apart)
    speed = np.einsum("...ij,...j->...i", axes, np.broadcast_to(moving, apart.shape))
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        times = np.stack([(-reach - where) / speed, (reach - where) / speed])
    still, inside = speed == 0.0, np.abs(where) <= reach
    enter = np.where(still, np.where(inside, -np.inf, np.inf), np.min(times, axis=0))
    leave = np.where(still, np.where(inside, np.inf, -np.inf), np.max(times, axis=0))
    return enter, leave


def _sides(heading: Numbers) -> Numbers:
    """The directions of a box's sides, shape (..., 2, 2)."""
    c, s = np.cos(heading), np.sin(heading)
    return np.stack([np.stack([c, s], axis=-1), np.stack([-s, c], axis=-1)], axis=-2)


def _shadow(box: Numbers, axes: Numbers) -> Numbers:
    """Half the length of a box's projection on each axis."""
    sides = _sides(box[..., 2])
    along = np.abs(np.einsum("...ij,...kj->...ik", axes, sides))  # (..., axes, sides)
    return np.asarray(np.einsum("...ik,...k->...i", along, box[..., 3:5] / 2.0))


def _dot(a: Numbers, b: Numbers) -> Numbers:
    """The scalar product over the last axis."""
    return np.asarray(np.sum(a * b, axis=-1))
