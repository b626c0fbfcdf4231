"""Go-Explore over decisions: return to a rare situation, go on from there; then work backward.

An archive keeps for each situation the decisions that led to it (Ecoffet et al., arXiv 1901.10995;
for tests: Koren and Kochenderfer, arXiv 2004.04292). Half of the points return to one of them and
go on by chance. The others work backward from the best episode: they keep its decisions but the
last, then but the last two, and so on, and look for a better end; a better episode takes its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cavsumo.agents.decisions import Situation
from cavsumo.searchers.decision_space import DecisionSpace
from cavsumo.searchers.protocol import GENERATION, LOWEST_GRADE, PlayedPoint
from cavsumo.searchers.space import Point

ROUNDS = 4  # points that keep so many decisions of the best episode, before one less is kept
FIRST = 2  # generations by chance


@dataclass
class Reached:
    """A situation of the archive.

    Attributes:
        rows: start and decisions that lead there.
        grade: of the best episode that came there.
        seen, chosen: how often it was reached, and how often it was returned to.
    """

    rows: NDArray[np.float64]
    grade: float
    seen: int = 1
    chosen: int = 0


class ExploreSearch:
    """An archive of situations, and the best episode from which it works backward."""

    uniform = False

    def __init__(self, space: DecisionSpace, rng: np.random.Generator) -> None:
        self.space, self.rng = space, rng
        self._archive: dict[tuple[int, Situation], Reached] = {}
        self._generation = 0
        self._best = -np.inf
        self._rows = np.empty((0, space.width))  # of the best episode, as far as it went
        self._tried = 0  # points since it was the best

    def ask(self) -> list[Point]:
        back = GENERATION // 2 if self._generation >= FIRST else 0
        begun = [self._kept() for _ in range(back)]
        begun += [self._returned() for _ in range(GENERATION - back)]
        return [self.space.completed(self.rng, rows) for rows in begun]

    def tell(self, points: Sequence[Point], told: Sequence[PlayedPoint]) -> None:
        self._generation += 1
        for point, result in zip(points, told, strict=True):
            rows = self.space.rows(point)
            self._reach(rows, result)
            if result.grade > self._best:
                self._best, self._tried = result.grade, 0
                self._rows = rows[: 1 + len(result.situations)]

    def _reach(self, rows: NDArray[np.float64], result: PlayedPoint) -> None:
        """Take up the situations of an episode; the best episode that came there is kept."""
        for i, situation in enumerate(result.situations):
            key = i, situation
            known = self._archive.get(key)
            if known is None:
                self._archive[key] = Reached(rows[: i + 1], result.grade)
                continue
            known.seen += 1
            if result.grade > known.grade:
                known.rows, known.grade, known.chosen = rows[: i + 1], result.grade, 0

    def _returned(self) -> NDArray[np.float64]:
        """The beginning that leads to a situation, rather to a rare one or one of good episodes."""
        if self._generation < FIRST or not self._archive:
            return np.empty((0, self.space.width))
        known = list(self._archive.values())
        weights = np.array([_promise(one) for one in known])
        one = known[int(self.rng.choice(len(known), p=weights / weights.sum()))]
        one.chosen += 1
        return one.rows

    def _kept(self) -> NDArray[np.float64]:
        """The beginning of the best episode, shorter the longer it has been the best."""
        less = 1 + self._tried // ROUNDS
        self._tried += 1
        kept = len(self._rows) - less
        if kept <= 0:
            self._tried, kept = 0, 0
        return self._rows[:kept]


def _promise(one: Reached) -> float:
    """How much a situation promises."""
    near = max(0.0, 1.0 + min(0.0, one.grade) / -LOWEST_GRADE)
    return float((0.1 + near**2) / np.sqrt(1.0 + one.chosen) / np.sqrt(one.seen))
