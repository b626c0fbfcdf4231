"""The protocol of searchers, and the simplest one: random points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from cavsumo.agents.decisions import Situation
from cavsumo.agents.searched import Programme
from cavsumo.searchers.places import Place
from cavsumo.searchers.space import Point, Space

GENERATION = 10  # points that are chosen together, before any of them is played
LOWEST_GRADE = -5.0  # of an invalid episode (``results.grade``); from 0 on are preventable failures
UNFAIR = (-3.0, -2.0)  # grades of unfair episodes, without the second


class PlayedPoint(NamedTuple):
    """The result of a point.

    Attributes:
        grade: how near it came to a preventable failure (``results.grade``).
        failed: whether it is a preventable failure.
        kind: of the failure; failures of one kind are alike.
        situations: in which the decisions were taken, of a point of ``DecisionSpace``.
        body: the number of the body that the verdict names; None for none.
        seconds: for how long it was played, in simulated time [s].
    """

    grade: float
    failed: bool
    kind: tuple[object, ...] = ()
    situations: tuple[Situation, ...] = ()
    body: int | None = None
    seconds: float = 0.0

    @property
    def spoilt(self) -> bool:
        """Whether it was unfair or invalid: no test of the ego."""
        return self.grade <= LOWEST_GRADE or UNFAIR[0] <= self.grade < UNFAIR[1]


class PointSpace(Protocol):
    """A space of tests, as those need it who play its points and speak about them."""

    @property
    def dimension(self) -> int: ...

    def memories(self, point: Point) -> tuple[dict[str, Any], ...]:
        """The memories with which the agents play a point."""

    def place(self, point: Point, body: int) -> Place:
        """Where a body starts."""

    def played(self, point: Point) -> list[tuple[Place, Programme | None]]:
        """The place and the programme of every body, None for one that stands by."""


class Searcher(Protocol):
    """Chooses the points of a generation from what came of those before.

    Attributes:
        space: of the points that were asked for last.
        uniform: whether they are uniform over the space.
    """

    @property
    def space(self) -> PointSpace: ...

    @property
    def uniform(self) -> bool: ...

    def ask(self) -> list[Point]:
        """The points of the next generation."""

    def tell(self, points: Sequence[Point], told: Sequence[PlayedPoint]) -> None:
        """Take up the results of a generation, which another searcher of the space may choose."""


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
