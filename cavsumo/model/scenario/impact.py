"""The impact point: where the ego's front and a body that goes straight would meet.

On the ego's way the place s of its front, and on the body's way the distance d, are such that

* the body's reference point is beside the middle of the front by (share - 1/2) times its width,
* and the body's box touches the line of the front.

For each s the first condition is linear in d, since the body goes straight; the second is solved
for s by bisection.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from cavsumo.model.curve import PlaneCurve, Pose

SCAN_M = 0.5  # between the places at which a touch is looked for
BEYOND_M = 60.0  # as far after the last leg of the ego's way
ROUNDS = 50  # of the bisection


class Front(NamedTuple):
    """The front of an ego: its way, the place of the axle behind the front, its width [m]."""

    way: PlaneCurve
    axle: float
    width: float

    def pose(self, along: float) -> Pose:
        """The middle of the front, and the ego's heading, when its front is there."""
        x, y, o = self.way.at(along - self.axle)
        return x + self.axle * math.cos(o), y + self.axle * math.sin(o), o


class Straight(NamedTuple):
    """A box that goes straight: its pose at the beginning, its sizes, its reference point [m]."""

    begin: Pose
    length: float
    width: float
    front: float


def impact(front: Front, body: Straight, share: float, begin: float) -> tuple[float, float]:
    """The place of the ego's front and the distance of the body at the impact [m].

    Args:
        share: from the right edge of the front (0) to its left (1).
        begin: place from which on an impact is looked for.

    Raises ValueError where they never meet so.
    """
    last = begin
    while last < front.way.length + front.axle + BEYOND_M:
        after = last + SCAN_M
        if _ahead(front, body, share, last) > 0.0 >= _ahead(front, body, share, after):
            return _bisected(front, body, share, last, after)
        last = after
    raise ValueError("begins.impact: the ego's front and the body never meet so")


def _bisected(
    front: Front, body: Straight, share: float, low: float, high: float
) -> tuple[float, float]:
    """The place of a touch between two places, and the distance of the body then."""
    for _ in range(ROUNDS):
        middle = (low + high) / 2
        if _ahead(front, body, share, middle) > 0.0:
            low = middle
        else:
            high = middle
    return high, _distance(front, body, share, high)


def _distance(front: Front, body: Straight, share: float, along: float) -> float:
    """How far the body has gone when its reference point is beside the front as wanted [m]."""
    x, y, o = front.pose(along)
    bx, by, heading = body.begin
    across = math.sin(heading - o)  # how fast it moves to the ego's left
    if abs(across) < 1e-6:
        return math.nan
    now = (by - y) * math.cos(o) - (bx - x) * math.sin(o)
    reference = body.length / 2 - body.front
    return ((share - 0.5) * front.width - now) / across - reference


def _ahead(front: Front, body: Straight, share: float, along: float) -> float:
    """From the line of the front to the body's box, when its reference point is as wanted [m]."""
    gone = _distance(front, body, share, along)
    x, y, o = front.pose(along)
    bx, by, heading = body.begin
    cx, cy = bx + gone * math.cos(heading), by + gone * math.sin(heading)
    turn = heading - o
    reach = (body.length * abs(math.cos(turn)) + body.width * abs(math.sin(turn))) / 2
    return (cx - x) * math.cos(o) + (cy - y) * math.sin(o) - reach
