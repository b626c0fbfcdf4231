"""Occlusion: the boxes that are visible from a point past the vehicles around it.

The sight lines to a box lead from the eye to its centre and to its four corners. A box blocks a
line that passes through its inside; a line that only touches a side is free. A box is hidden if
each of its five lines is blocked, by one vehicle or by several. A box is therefore hidden if
neither its centre nor a corner is visible, even if another part is.

A line from e to e + d with the middle m = e + d / 2 passes through the inside of a box of half
sides h, all in the frame of that box, if and only if none of the three axes separates them::

    |m_x| < h_x + |d_x| / 2,    |m_y| < h_y + |d_y| / 2,
    |d_x m_y - d_y m_x| < h_x |d_y| + h_y |d_x|
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cavsumo.model.geometry import Box, Point

Floats = NDArray[np.float64]
# The centre and the corners of a box in its own frame, in halves of its length and width.
ALONG = np.array((0.0, 1.0, -1.0, -1.0, 1.0))
ACROSS = np.array((0.0, 1.0, 1.0, -1.0, -1.0))


def in_sight(eye: Point, boxes: Sequence[Box], hiding: Sequence[bool]) -> list[bool]:
    """Whether each of n boxes is visible from a point.

    Args:
        eye: the point [m].
        boxes: the boxes.
        hiding: which of them hide others. A box does not hide itself, and a box that contains the
            eye hides no other.
    """
    if not any(hiding):
        return [True] * len(boxes)
    x, y, o, length, width = np.array(boxes, dtype=float).T
    x, y, half, side = x - eye[0], y - eye[1], length / 2, width / 2
    c, s = np.cos(o), np.sin(o)
    ex, ey = -x * c - y * s, x * s - y * c  # the eye in the frame of each box
    outside = (np.abs(ex) > half) | (np.abs(ey) > side)
    seen, by = _near_lines(x, y, np.hypot(half, side), outside & np.array(hiding))
    free = np.ones((len(boxes), len(ALONG)), dtype=bool)
    if len(seen):
        px = x[seen, None] + ALONG * (half * c)[seen, None] - ACROSS * (side * s)[seen, None]
        py = y[seen, None] + ALONG * (half * s)[seen, None] + ACROSS * (side * c)[seen, None]
        c, s, ex, ey = c[by, None], s[by, None], ex[by, None], ey[by, None]
        dx, dy = px * c + py * s, py * c - px * s
        cut = _passes_through(ex, ey, dx, dy, half[by, None], side[by, None])
        np.logical_and.at(free, seen, ~cut)
    return [True in lines for lines in free.tolist()]


def _passes_through(
    ex: Floats, ey: Floats, dx: Floats, dy: Floats, hx: Floats, hy: Floats
) -> NDArray[np.bool_]:
    """Which lines from e to e + d, (pairs, 5), pass through the inside of the box they are with."""
    mx, my, wx, wy = ex + dx / 2, ey + dy / 2, np.abs(dx), np.abs(dy)
    passing: NDArray[np.bool_] = np.abs(dx * my - dy * mx) < hx * wy + hy * wx
    passing &= (np.abs(mx) < hx + wx / 2) & (np.abs(my) < hy + wy / 2)
    return passing


def _near_lines(
    x: Floats, y: Floats, reach: Floats, hiding: NDArray[np.bool_]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The pairs (seen, by) of which the second may cut a line to the first.

    No point of a sight line is farther from the one to the centre than the reach of the box that
    is looked at, so a box farther away than both reaches together cuts none.
    """
    by = np.flatnonzero(hiding)
    bx, by_ = x[by], y[by]
    square = np.maximum(x * x + y * y, 1e-12)
    share = np.clip((np.outer(x, bx) + np.outer(y, by_)) / square[:, None], 0.0, 1.0)
    away = (bx - share * x[:, None]) ** 2 + (by_ - share * y[:, None]) ** 2
    near = away < (reach[:, None] + reach[by]) ** 2
    near[by, np.arange(len(by))] = False
    seen, which = np.nonzero(near)
    return seen, by[which]
