"""Search near the best points so far: a preventable failure is rarely alone.

One point is kept for each manner of moving (MAP-Elites: Mouret and Clune, arXiv 1504.04909), so
that a manner in which the ego only ever comes close to failing does not hide the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from cavsumo.searchers.protocol import GENERATION, PlayedPoint, Searcher
from cavsumo.searchers.space import Point, Space

BEST, SHARE_OF_BEST = 4, 0.6  # how often one of so many best points is varied
SHARE_OF_FAILED = 0.7  # how often a preventable failure is varied, if there is one
SPREAD = 0.08  # typical step of a number
SHARE = 0.4  # of the numbers change

Manner = tuple[int, ...]


@dataclass
class NeighbourSearch:
    """Varies the best point of a manner, of any searcher; begins with the points of another one."""

    space: Space
    rng: np.random.Generator
    first: Searcher
    best: dict[Manner, tuple[float, Point]] = field(default_factory=dict)
    uniform: bool = False

    def ask(self) -> list[Point]:
        if not self.best:
            return self.first.ask()
        return [self._near(self._chosen()) for _ in range(GENERATION)]

    def tell(self, points: Sequence[Point], told: Sequence[PlayedPoint]) -> None:
        for point, result in zip(points, told, strict=True):
            manner = self.space.manner(point)
            if manner not in self.best or result.grade > self.best[manner][0]:
                self.best[manner] = result.grade, point

    def _chosen(self) -> Point:
        """The point to vary."""
        failed = [point for grade, point in self.best.values() if grade >= 0.0]
        if failed and self.rng.random() < SHARE_OF_FAILED:
            return failed[int(self.rng.integers(len(failed)))]
        ranked = sorted(self.best.values(), key=lambda one: -one[0])
        most = BEST if self.rng.random() < SHARE_OF_BEST else len(ranked)
        return ranked[int(self.rng.integers(min(most, len(ranked))))][1]

    def _near(self, point: Point) -> Point:
        """A point near another one, reflected at the borders of the space."""
        spread = SPREAD * float(np.exp(self.rng.normal(0.0, 0.8)))
        moved = self.rng.random(len(point)) < SHARE
        moved[self.rng.integers(len(point))] = True
        fresh: Point = np.abs(point + moved * self.rng.normal(0.0, spread, len(point)))
        return np.clip(1.0 - np.abs(1.0 - fresh), 0.0, 1.0)
