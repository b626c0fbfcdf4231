"""Oriented boxes on the plane: overlap, distance, coordinates seen from another pose; angles.

Lengths in metres, angles in radians anticlockwise from east. Plain floats only, for the simulator's
inner loop; NaN in a box is not checked for.
"""

from __future__ import annotations

import math
from math import cos, sin
from typing import NamedTuple

Point = tuple[float, float]

# m; boxes this close touch. Above the rounding error of coordinates up to 100 km (1e-11 m), so
# that touching does not depend on the heading, and below any distance that matters.
TOUCH = 1e-10


class Box(NamedTuple):
    """A rectangle: its centre (x, y) [m], heading [rad], length along and width across it [m]."""

    x: float
    y: float
    heading: float
    length: float
    width: float


def wrap(angle: float) -> float:
    """Return `angle` [rad] brought into (-pi, pi] (seed, eqs 19 and 21); -pi becomes +pi.

    Raises:
        ValueError: the angle is infinite.
    """
    wrapped = math.remainder(angle, math.tau)
    return math.pi if wrapped <= -math.pi else wrapped


def corners(box: Box) -> list[Point]:
    """Return the corners of `box` [m], anticlockwise from the front left."""
    x, y, heading, length, width = box
    c, s = 0.5 * cos(heading), 0.5 * sin(heading)
    along_x, along_y, across_x, across_y = length * c, length * s, -width * s, width * c
    return [
        (x + along_x + across_x, y + along_y + across_y),
        (x - along_x + across_x, y - along_y + across_y),
        (x - along_x - across_x, y - along_y - across_y),
        (x + along_x - across_x, y + along_y - across_y),
    ]


def in_frame(box: Box, x: float, y: float, heading: float) -> Box:
    """Return `box` as seen from the pose (x, y, heading); its heading is not wrapped."""
    dx, dy, c, s = box.x - x, box.y - y, cos(heading), sin(heading)
    return Box(dx * c + dy * s, dy * c - dx * s, box.heading - heading, box.length, box.width)


def overlap(a: Box, b: Box) -> bool:
    """Return whether the boxes overlap or touch, that is, come within `TOUCH` of each other.

    Separating axes: two rectangles are apart if and only if their shadows are apart on one of the
    four directions of their sides.
    """
    ax, ay, ah, al, aw = a
    bx, by, bh, bl, bw = b
    dx, dy = bx - ax, by - ay
    # Half of length + width bounds half the diagonal and needs no root.
    reach = 0.5 * (al + aw + bl + bw) + TOUCH
    if dx * dx + dy * dy > reach * reach:
        return False
    ca, sa, cb, sb = cos(ah), sin(ah), cos(bh), sin(bh)
    c, s = abs(ca * cb + sa * sb), abs(ca * sb - sa * cb)
    return (
        abs(dx * ca + dy * sa) <= 0.5 * (al + bl * c + bw * s) + TOUCH
        and abs(dy * ca - dx * sa) <= 0.5 * (aw + bl * s + bw * c) + TOUCH
        and abs(dx * cb + dy * sb) <= 0.5 * (bl + al * c + aw * s) + TOUCH
        and abs(dy * cb - dx * sb) <= 0.5 * (bw + al * s + aw * c) + TOUCH
    )


def gap(a: Box, b: Box) -> float:
    """Return the smallest distance between the boxes [m]; 0 if they overlap or touch.

    Between two convex polygons that are apart, the smallest distance is found at a corner of one.
    """
    return 0.0 if overlap(a, b) else min(_corner_distance(a, b), _corner_distance(b, a))


def _corner_distance(a: Box, b: Box) -> float:
    """The smallest distance from a corner of `a` to the box `b` [m]."""
    seen = corners(in_frame(a, b.x, b.y, b.heading))
    half_length, half_width = 0.5 * b.length, 0.5 * b.width
    return min(
        math.hypot(max(abs(x) - half_length, 0.0), max(abs(y) - half_width, 0.0)) for x, y in seen
    )
