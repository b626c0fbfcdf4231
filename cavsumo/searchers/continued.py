"""A search that begins with points of an earlier one, of the same space."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field

from cavsumo.searchers.protocol import GENERATION, PlayedPoint, PointSpace, Searcher
from cavsumo.searchers.space import Point, Space

SPACE = "space of tests"  # its fingerprint in a manifest


@dataclass
class ContinuedSearch:
    """First some points of the searcher's space, then those that the searcher asks for.

    The points are played anew, as what came of them may have been with another ego, and the
    searcher is told what came of them.
    """

    searcher: Searcher
    points: Sequence[Point]
    _asked: int = field(default=0, init=False)  # how many of the points
    _uniform: bool = field(default=False, init=False)

    @property
    def space(self) -> PointSpace:
        return self.searcher.space

    @property
    def uniform(self) -> bool:
        return self._uniform

    def ask(self) -> list[Point]:
        fresh = list(self.points[self._asked : self._asked + GENERATION])
        self._asked += len(fresh)
        asked = fresh or self.searcher.ask()
        self._uniform = not fresh and self.searcher.uniform
        return asked

    def tell(self, points: Sequence[Point], told: Sequence[PlayedPoint]) -> None:
        self.searcher.tell(points, told)


def fingerprint(space: Space) -> str:
    """The SHA-256 of what makes points of a space the same tests, but for the ego's behaviour."""
    places = [(p.whence, p.along, p.lead, p.away) for p in space.movements.places]
    facts = (space.coordinates, space.teams, space.every, places)
    return hashlib.sha256(repr(facts).encode()).hexdigest()
