"""Expectations of a point before it is played: the results of tests like it.

Each body that takes part is compared with the bodies of the points so far: where it starts and
what it does. A result counts for the body that the verdict names; if nobody was met, for all that
took part. So the one of several proposals is played that promises most (pre-selection with a
surrogate, as in evolution strategies: Jin, Swarm and Evolutionary Computation 1 (2011) 61-70).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cavsumo.searchers.protocol import PlayedPoint
from cavsumo.searchers.space import Point, Space

SPOILT, FAILED = -1.5, 2.0  # values; of other tests 0 to 1, of nobody met 0
WEIGHTS = {"zone": 4.0, "speed": 1.5, "heading": 1.5, "depth": 1.5}  # of differences
WEIGHT = 0.4  # of those of other numbers
ALONG_M, OTHER_SIDE, BY_REACTION = 15.0, 1.0, 2.0  # differences that count as 1, or as so much
LIKE = 0.5  # distance at which two bodies are alike
UNKNOWN = 1.0  # weight of a prior value
PRIOR = 0.2  # that value
PER_M = 0.5 / 100.0  # cost of a metre of the ego's approach, as nothing is tested meanwhile

Known = NDArray[np.float64]


class Expected:
    """Values of points by the results of those so far: from SPOILT to FAILED, less their costs."""

    def __init__(self, space: Space) -> None:
        self.space = space
        self._told: set[bytes] = set()
        self._known = np.empty((0, 3 + len(space.movements.meanings) - 1))
        self._values = np.empty(0)
        self._sides = sorted({place.whence for place in space.movements.places})

    def tell(self, points: Sequence[Point], told: Sequence[PlayedPoint]) -> None:
        """Take up results; those that are known already are passed over."""
        for point, result in zip(points, told, strict=True):
            key = point.tobytes()
            if key in self._told:
                continue
            self._told.add(key)
            met = [f for i, f in self._bodies(point).items() if result.body in (None, i)]
            self._known = np.vstack([self._known, *met])
            self._values = np.append(self._values, [value_of(result)] * len(met))

    def value(self, point: Point) -> float:
        """The value that is expected of a point: that of its worst body, if that would spoil it."""
        bodies = self._bodies(point)
        values = [self._value(features) for features in bodies.values()]
        way = float(np.mean([self._along(features) for features in bodies.values()]))
        worst = min(values)
        return (worst if worst < 0.0 else max(values)) - PER_M * way

    def _value(self, features: Known) -> float:
        """The mean value of the bodies that are like one, and a prior."""
        squares = ((self._known - features) ** 2).sum(axis=1)
        weights = np.exp(-0.5 * squares / LIKE**2)
        total = float(weights @ self._values) + UNKNOWN * PRIOR
        return total / (float(weights.sum()) + UNKNOWN)

    def _bodies(self, point: Point) -> dict[int, Known]:
        """The features of each body that takes part, scaled so that differences count alike."""
        return {
            i: self._features(point, i, place.along, place.whence, programme.cue)
            for i, (place, programme) in enumerate(self.space.played(point))
            if programme is not None
        }

    def _features(
        self, point: Point, body: int, along: float, whence: str, cue: float | str
    ) -> Known:
        shares = self.space.shares(point, body)
        own = [WEIGHTS.get(name, WEIGHT) * u for name, u in shares.items() if name != "place"]
        side = OTHER_SIDE * self._sides.index(whence)
        return np.array([along / ALONG_M, side, BY_REACTION * isinstance(cue, str), *own])

    @staticmethod
    def _along(features: Known) -> float:
        """Where a body meets the ego's path [m]."""
        return float(features[0]) * ALONG_M


def value_of(result: PlayedPoint) -> float:
    """The value of a point: FAILED, SPOILT, 0 to 1 of other tests, 0 if nobody was met."""
    if result.failed:
        return FAILED
    return SPOILT if result.spoilt else min(1.0, max(0.0, (result.grade + 2.0) / 2.0))
