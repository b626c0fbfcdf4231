"""Search near the best points so far: a preventable failure is rarely alone.

One failure is kept for each kind, the hardest; its neighbours are chosen by how often they failed
and how short they were, at a distance at which about two of five still fail. So the search goes
over a region of failures and beyond its borders, towards harder ones, and does not repeat a point.

Until there is a failure, one point is kept for each manner of moving (MAP-Elites: Mouret and Clune,
arXiv 1504.04909), so that a manner in which the ego only ever comes close does not hide the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from cavsumo.searchers.manoeuvres import ManoeuvreSearch
from cavsumo.searchers.protocol import GENERATION, PlayedPoint
from cavsumo.searchers.space import Point, Space

BEST, SHARE_OF_BEST = 4, 0.6  # how often one of so many best points is varied
SHARE_OF_FAILED = 0.85  # how often a preventable failure is varied, if there is one
SPREAD = 0.08  # typical step of a number
LEAST_SPREAD, MOST_SPREAD = 0.015, 0.2  # of the steps from a failure
WIDER, NARROWER = 1.15, 0.9  # steps from a failure after one that failed, and one that did not
SHARE = 0.4  # of the numbers change
START_S = 5.0  # time that an episode costs apart from its simulated seconds
PRIOR = 1.5  # neighbours for a failure, before any is played
MOST_MPS = 6.0  # harder impacts count as this one

Manner = tuple[int, ...]


@dataclass
class FailedPoint:
    """A preventable failure, and the results of its neighbours.

    Attributes:
        point, grade, seconds: of the failure.
        spread: typical step of a number to a neighbour.
        failed: how many neighbours failed.
        spent: time that the neighbours took [s], of those that were unfair or invalid twice.
    """

    point: Point
    grade: float
    seconds: float
    spread: float = SPREAD / 2
    failed: int = 0
    spent: float = 0.0

    def tell(self, result: PlayedPoint) -> None:
        """Take up the result of a neighbour."""
        self.failed += result.failed
        self.spent += (1.0 + result.spoilt) * (result.seconds + START_S)
        step = WIDER if result.failed else NARROWER**2 if result.spoilt else NARROWER
        spread = self.spread * step
        self.spread = min(MOST_SPREAD, max(LEAST_SPREAD, spread))

    @property
    def promise(self) -> float:
        """How much its neighbours promise: failures in a second, rather hard ones."""
        rate = (self.failed + 1.0) / (self.spent + PRIOR * (self.seconds + START_S))
        return rate * (1.0 + min(self.grade, MOST_MPS))


@dataclass
class NeighbourSearch:
    """Varies the best points of any searcher; begins with the points of another one.

    Attributes:
        best: the best point of each manner, and its grade.
        failed: the hardest failure of each kind.
    """

    space: Space
    rng: np.random.Generator
    first: ManoeuvreSearch
    best: dict[Manner, tuple[float, Point]] = field(default_factory=dict)
    failed: dict[tuple[object, ...], FailedPoint] = field(default_factory=dict)
    uniform: bool = False
    _from: dict[bytes, FailedPoint] = field(default_factory=dict)  # the failure of each neighbour

    def ask(self) -> list[Point]:
        if not self.best:
            return self.first.ask()
        return [self._next() for _ in range(GENERATION)]

    def tell(self, points: Sequence[Point], told: Sequence[PlayedPoint]) -> None:
        self.first.expected.tell(points, told)
        for point, result in zip(points, told, strict=True):
            origin = self._from.pop(point.tobytes(), None)
            if origin is not None:
                origin.tell(result)
            manner = self.space.manner(point)
            if manner not in self.best or result.grade > self.best[manner][0]:
                self.best[manner] = result.grade, point
            if result.failed:
                self._keep(point, result, origin)

    def _keep(self, point: Point, result: PlayedPoint, origin: FailedPoint | None) -> None:
        """Keep a failure if it is the hardest of its kind."""
        known = self.failed.get(result.kind)
        if known is None or result.grade > known.grade:
            spread = SPREAD / 2 if origin is None else origin.spread
            self.failed[result.kind] = FailedPoint(point, result.grade, result.seconds, spread)

    def _next(self) -> Point:
        """The next point: near a failure, or near one of the best points."""
        if self.failed and self.rng.random() < SHARE_OF_FAILED:
            failures = list(self.failed.values())
            promise = np.array([one.promise for one in failures])
            one = failures[int(self.rng.choice(len(failures), p=promise / promise.sum()))]
            point = self.first.most_promising(lambda: self._near(one.point, one.spread))
            self._from[point.tobytes()] = one
            return point
        return self.first.most_promising(lambda: self._near(self._promising(), SPREAD))

    def _promising(self) -> Point:
        """One of the best points."""
        ranked = sorted(self.best.values(), key=lambda one: -one[0])
        most = BEST if self.rng.random() < SHARE_OF_BEST else len(ranked)
        return ranked[int(self.rng.integers(min(most, len(ranked))))][1]

    def _near(self, point: Point, spread: float) -> Point:
        """A point near another one, reflected at the borders of the space."""
        step = spread * float(np.exp(self.rng.normal(0.0, 0.8)))
        moved = self.rng.random(len(point)) < SHARE
        moved[self.rng.integers(len(point))] = True
        fresh: Point = np.abs(point + moved * self.rng.normal(0.0, step, len(point)))
        return np.clip(1.0 - np.abs(1.0 - fresh), 0.0, 1.0)
