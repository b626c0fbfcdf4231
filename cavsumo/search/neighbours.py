"""Search near the best points so far: a preventable failure is rarely alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from cavsumo.search.searchers import GENERATION, Searcher, Told
from cavsumo.search.space import Point, Space

KEPT = 16
RANKS = 4.0  # mean rank of the points that are varied
SPREAD = 0.1  # typical step of a number
SHARE = 0.4  # of the numbers change


@dataclass
class NeighbourSearch:
    """Varies the best points, whoever chose them; begins with those of another searcher."""

    space: Space
    rng: np.random.Generator
    first: Searcher
    best: list[tuple[float, Point]] = field(default_factory=list)
    uniform: bool = False

    def ask(self) -> list[Point]:
        if not self.best:
            return self.first.ask()
        return [self._near(self.best[self._rank()][1]) for _ in range(GENERATION)]

    def tell(self, points: Sequence[Point], told: Sequence[Told]) -> None:
        found = [(t.grade, p) for p, t in zip(points, told, strict=True)]
        self.best = sorted([*self.best, *found], key=lambda one: -one[0])[:KEPT]

    def _rank(self) -> int:
        return min(int(self.rng.exponential(RANKS)), len(self.best) - 1)

    def _near(self, point: Point) -> Point:
        """A point near another one, reflected at the borders of the space."""
        spread = SPREAD * float(np.exp(self.rng.normal(0.0, 0.8)))
        moved = self.rng.random(len(point)) < SHARE
        moved[self.rng.integers(len(point))] = True
        fresh = point + moved * self.rng.normal(0.0, spread, len(point))
        turned: Point = np.abs(fresh)
        turned = 1.0 - np.abs(1.0 - turned)
        return np.clip(turned, 0.0, 1.0)
