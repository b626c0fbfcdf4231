"""A way of straight lines, arcs and clothoids, exact at every arc length.

On a leg the curvature changes evenly from k0 to k1 over its length L. At a distance u along it::

    heading(u) = heading(0) + k0 u + (k1 - k0) u^2 / (2 L)
    x(u), y(u) = x(0), y(0) + integral from 0 to u of (cos, sin)(heading)

The integral of a clothoid (Fresnel) is computed by Gauss-Legendre quadrature with 16 points, whose
error is below the rounding error for legs that turn by less than a right angle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate
from typing import NamedTuple

from cavsumo.model.geometry import wrap
from cavsumo.model.polyline import Path

Pose = tuple[float, float, float]  # x, y [m], heading [rad]

STEP_M = 0.2  # between the points of a polyline on a bend


class Bend(NamedTuple):
    """A leg of a way: its length [m] and the curvatures at its ends [1/m], positive to the left."""

    length: float
    first: float
    last: float


class PlaneCurve:
    """A way that begins at a pose; before it and after its last leg it is prolonged straight on.

    Args:
        begin: where it begins.
        legs: one after another.
        apart: distance of the points [m] between which it is straight and its heading changes
            evenly, from the beginning on; None for the smooth curve.
    """

    def __init__(self, begin: Pose, legs: Sequence[Bend] = (), apart: float | None = None) -> None:
        self._apart = apart
        self.legs = tuple(leg for leg in legs if leg.length > 0.0)
        self._starts = [0.0, *accumulate(leg.length for leg in self.legs)]
        self._poses = [begin]
        for leg in self.legs:
            self._poses.append(_along(self._poses[-1], leg, leg.length))

    @property
    def length(self) -> float:
        """Length of all legs [m]."""
        return self._starts[-1]

    def at(self, along: float) -> Pose:
        """The pose at an arc length [m], also before the beginning and after the end."""
        if self._apart is None or not 0.0 < along < self.length:
            return self._smooth(along)
        share, i = math.modf(along / self._apart)
        before, after = (self._smooth(k * self._apart) for k in (i, i + 1.0))
        x, y = (a + share * (b - a) for a, b in zip(before[:2], after[:2], strict=True))
        return x, y, wrap(before[2] + share * wrap(after[2] - before[2]))

    def _smooth(self, along: float) -> Pose:
        """The pose on the smooth curve."""
        last = len(self.legs)
        i = next((i for i in range(last) if along < self._starts[i + 1]), last)
        if along <= 0.0 or i == last:
            x, y, o = self._poses[0 if along <= 0.0 else last]
            u = along - (0.0 if along <= 0.0 else self._starts[last])
            return x + u * math.cos(o), y + u * math.sin(o), wrap(o)
        x, y, o = _along(self._poses[i], self.legs[i], along - self._starts[i])
        return x, y, wrap(o)

    def polyline(self, begin: float, end: float) -> Path:
        """The way between two arc lengths as a polyline, with points close together on bends."""
        marks = {begin, end}
        for start, leg in zip(self._starts, self.legs, strict=False):
            bent = leg.first != 0.0 or leg.last != 0.0
            count = math.ceil(leg.length / STEP_M) if bent else 1
            marks |= {start + leg.length * i / count for i in range(count + 1)}
        return Path([self.at(s)[:2] for s in sorted(marks) if begin <= s <= end])


def _along(begin: Pose, leg: Bend, u: float) -> Pose:
    """The pose at a distance along a leg that begins at a pose."""
    x, y, o = begin
    rate = (leg.last - leg.first) / (2.0 * leg.length)
    if leg.first == 0.0 == leg.last:
        return x + u * math.cos(o), y + u * math.sin(o), o
    half = u / 2.0
    for node, weight in GAUSS:
        for t in (half * (1.0 - node), half * (1.0 + node)):
            heading = o + leg.first * t + rate * t * t
            x += half * weight * math.cos(heading)
            y += half * weight * math.sin(heading)
    return x, y, o + leg.first * u + rate * u * u


# Positive nodes of the quadrature with 16 points on [-1, 1], and their weights.
GAUSS = (
    (0.0950125098376374, 0.1894506104550685),
    (0.2816035507792589, 0.1826034150449236),
    (0.4580167776572274, 0.1691565193950025),
    (0.6178762444026438, 0.1495959888165767),
    (0.7554044083550030, 0.1246289712555339),
    (0.8656312023878318, 0.0951585116824928),
    (0.9445750230732326, 0.0622535239386479),
    (0.9894009349916499, 0.0271524594117541),
)
