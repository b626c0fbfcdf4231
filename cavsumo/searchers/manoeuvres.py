"""Manoeuvres that pedestrians are known for, as distributions over the space of tests.

A search begins here: a blindly timed crossing, somebody slow or oblique, who hesitates, turns back,
or walks along the lane and turns in. Every number that a manoeuvre leaves open is uniform.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cavsumo.searchers.protocol import GENERATION, PlayedPoint
from cavsumo.searchers.space import NAMES, Point, Space

Range = tuple[float, float]
STRAIGHT: Range = (0.45, 0.55)
THROUGH: Range = (0.98, 1.0)
LATE: Range = (0.15, 0.5)  # as an ego that did not react before could hardly stop
EARLY: Range = (0.2, 1.0)
SHORT: Range = (0.1, 0.4)  # as an ego that keeps its speed could not stop any more

# For each manoeuvre the ranges of some numbers of ``space.NAMES``.
MANOEUVRES: Mapping[str, Mapping[str, Range]] = {
    "crosses": {"zone": LATE, "speed": (0.5, 1.0), "heading": STRAIGHT, "depth": THROUGH},
    "crosses slowly": {"zone": LATE, "speed": (0.0, 0.35), "heading": STRAIGHT, "depth": THROUGH},
    "comes towards": {"zone": LATE, "speed": (0.0, 0.6), "heading": (0.0, 0.35), "depth": THROUGH},
    "walks away": {"zone": LATE, "heading": (0.65, 1.0), "depth": THROUGH},
    "comes closer, then steps in": {
        "zone": SHORT, "speed": (0.0, 0.5), "heading": (0.1, 0.6), "depth": (0.05, 0.3),
        "resume": (0.0, 0.12), "speed_2": (0.7, 1.0), "heading_2": (0.3, 0.5),
        "length_2": (0.7, 1.0), "heading_3": (0.3, 0.5),
    },
    "hesitates": {
        "zone": EARLY, "depth": (0.05, 0.4), "resume": (0.1, 0.5), "heading_2": STRAIGHT,
        "heading_3": STRAIGHT,
    },
    "waits on the road": {
        "zone": EARLY, "depth": (0.0, 0.35), "resume": (0.55, 0.8), "heading_2": STRAIGHT,
        "heading_3": STRAIGHT,
    },
    "turns back": {
        "zone": EARLY, "depth": (0.6, 0.97), "resume": (0.0, 0.3), "heading_2": (0.85, 1.0),
        "length_2": (0.3, 1.0), "heading_3": (0.9, 1.0),
    },
    "turns in": {
        "zone": EARLY, "depth": (0.0, 0.35), "resume": (0.0, 0.15), "heading_2": (0.15, 0.3),
        "heading_3": (0.4, 0.6), "length_2": (0.1, 0.8),
    },
    "stands": {"zone": EARLY, "depth": (0.35, 0.8), "resume": (0.4, 0.5)},
}  # fmt: skip


@dataclass
class ManoeuvreSearch:
    """Each point one of ``MANOEUVRES`` for each body, in turn."""

    space: Space
    rng: np.random.Generator
    turn: int = 0
    uniform: bool = False

    def ask(self) -> list[Point]:
        return [self._drawn() for _ in range(GENERATION)]

    def tell(self, points: Sequence[Point], told: Sequence[PlayedPoint]) -> None:
        """Nothing is learned."""

    def _drawn(self) -> Point:
        point, named = self.rng.random(self.space.dimension), list(MANOEUVRES)
        for i in range(self.space.bodies):
            ranges = MANOEUVRES[named[(self.turn + i) % len(named)]]
            for name, (low, high) in ranges.items():
                point[i * len(NAMES) + NAMES.index(name)] = self.rng.uniform(low, high)
        self.turn += 1
        return point
