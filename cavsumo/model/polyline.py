"""Polylines with arc length: the ego's path, a pavement's axis. Plain floats, no numpy."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable
from itertools import pairwise
from typing import NamedTuple

Point = tuple[float, float]


class Projection(NamedTuple):
    """Where a point lies relative to a path."""

    along: float  # arc length of the nearest point of the path [m]
    lateral: float  # distance from the path, positive to its left [m]
    segment: int  # index of the nearest segment, the hint for the next projection


class Path:
    """A polyline of at least two different points, in metres."""

    def __init__(self, points: Iterable[Point]) -> None:
        kept: list[Point] = []
        for x, y in points:
            if not kept or math.dist(kept[-1], (x, y)) > 1e-6:
                kept.append((float(x), float(y)))
        if len(kept) < 2:
            raise ValueError("a path needs at least two different points")
        self.points: tuple[Point, ...] = tuple(kept)
        self._starts = [0.0]
        self._segments: list[tuple[float, float, float, float, float]] = []
        for (x0, y0), (x1, y1) in pairwise(kept):
            length = math.dist((x0, y0), (x1, y1))
            self._segments.append((x0, y0, (x1 - x0) / length, (y1 - y0) / length, length))
            self._starts.append(self._starts[-1] + length)
        self.length = self._starts[-1]

    def project(self, x: float, y: float, near: int | None = None) -> Projection:
        """The nearest point of the path; ``near`` names the segment to search around first.

        The path is not prolonged: beyond its ends ``along`` is 0 or the length.
        """
        first, last = 0, len(self._segments)
        if near is not None:
            first, last = max(0, near - 1), min(last, near + 3)
        found, along, nearest = first, 0.0, math.inf
        for i, (x0, y0, ux, uy, length) in enumerate(self._segments[first:last], first):
            dx, dy = x - x0, y - y0
            t = dx * ux + dy * uy
            t = 0.0 if t < 0.0 else length if t > length else t
            ex, ey = dx - t * ux, dy - t * uy
            square = ex * ex + ey * ey
            if square < nearest:
                found, along, nearest = i, t, square
        if near is not None and found in (first, last - 1) and 0 < found < len(self._segments) - 1:
            return self.project(x, y)  # at the edge of the window: it may lie beyond
        x0, y0, ux, uy, _ = self._segments[found]
        side = math.copysign(math.sqrt(nearest), ux * (y - y0) - uy * (x - x0))
        return Projection(self._starts[found] + along, side, found)

    def at(self, along: float) -> tuple[float, float, float]:
        """Point and heading (x, y, o) at an arc length; prolonged straight beyond the ends."""
        i = min(len(self._segments) - 1, max(0, bisect_right(self._starts, along) - 1))
        x0, y0, ux, uy, _ = self._segments[i]
        t = along - self._starts[i]
        return x0 + t * ux, y0 + t * uy, math.atan2(uy, ux)

    def curvature(self, along: float, window: float = 3.0) -> float:
        """Mean change of heading per metre within a window to either side [1/m], >= 0."""
        before, after = self.at(along - window)[2], self.at(along + window)[2]
        return abs(math.remainder(after - before, math.tau)) / (2.0 * window)

    def meet(self, x: float, y: float, heading: float) -> tuple[float, float] | None:
        """Where a ray first meets the path: (distance on the ray, arc length), or None [m]."""
        cos, sin = math.cos(heading), math.sin(heading)
        best: tuple[float, float] | None = None
        for start, (x0, y0, ux, uy, length) in zip(self._starts, self._segments, strict=False):
            cross = ux * sin - uy * cos
            if abs(cross) < 1e-9:
                continue
            dx, dy = x - x0, y - y0
            distance = (dx * uy - dy * ux) / cross
            t = (dx * sin - dy * cos) / cross
            if (
                distance >= 0
                and -1e-9 <= t <= length + 1e-9
                and (best is None or distance < best[0])
            ):
                best = distance, start + t
        return best

    def cut(self, start: float, end: float) -> Path:
        """The part between two arc lengths, 0 <= start < end <= length."""
        inner = [p for p, s in zip(self.points, self._starts, strict=True) if start < s < end]
        return Path([self.at(start)[:2], *inner, self.at(end)[:2]])
