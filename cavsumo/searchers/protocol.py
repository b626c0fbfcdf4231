"""The protocol of searchers, and the simple ones: random points, and neighbours of good ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from cavsumo.searchers.space import Point, Space

GENERATION = 10  # points that are chosen together, before any of them is played


class PlayedPoint(NamedTuple):
    """The result of a point.

    Attributes:
        grade: how near it came to a preventable failure (``results.grade``).
        failed: whether it is a preventable failure.
        kind: of the failure; failures of one kind are alike.
    """

    grade: float
    failed: bool
    kind: tuple[object, ...] = ()


class Searcher(Protocol):
    """Chooses the points of a generation from what came of those before.

    Attributes:
        uniform: whether the points that were asked for last are uniform over the space.
    """

    @property
    def uniform(self) -> bool: ...

    def ask(self) -> list[Point]:
        """The points of the next generation."""

    def tell(self, points: Sequence[Point], told: Sequence[PlayedPoint]) -> None:
        """Take up the results of a generation, which another searcher may have chosen."""


@dataclass
class RandomSearch:
    """Uniform over the space: the honest baseline."""

    space: Space
    rng: np.random.Generator
    uniform: bool = True

    def ask(self) -> list[Point]:
        return list(self.rng.random((GENERATION, self.space.dimension)))

    def tell(self, points: Sequence[Point], told: Sequence[PlayedPoint]) -> None:
        """Nothing is learned."""
