"""The searches of a batch: which point each episode of a searching agent plays.

A searcher chooses a generation of points from what came of the generations before, in the order of
their numbers. So the points depend on nothing but the seed and the rows, and a batch is continued
by telling a new searcher the rows that are there.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cavsumo.agents.decisions import read
from cavsumo.batch.jobs import Memory
from cavsumo.results.alike import FEATURES, kind_of
from cavsumo.results.failures import graded
from cavsumo.results.rows import cell
from cavsumo.searchers.continued import ContinuedSearch
from cavsumo.searchers.methods import searcher_of
from cavsumo.searchers.protocol import PlayedPoint, PointSpace
from cavsumo.searchers.space import Point, Space
from cavsumo.searchers.words import Failure, in_common


@dataclass(frozen=True)
class SearchFacts:
    """The findings of a search.

    Attributes:
        episodes, seconds: how many points were played, and for how long in simulated time [s].
        failures, distinct: preventable failures, and how many kinds of them.
        first: after how many episodes, and simulated seconds, the first was found; None for none.
        words: what the failures have in common.
        uniform, covered: how many points were uniform over the space, and the share of its cells
            (place, side, moment, speed) in which a point was played.
    """

    episodes: int
    seconds: float
    failures: int
    distinct: int
    first: tuple[int, float] | None
    words: str
    uniform: int
    covered: float


@dataclass(frozen=True)
class SearchOrder:
    """The search that a batch asks for.

    Attributes:
        label: of the agent.
        method: how points are chosen.
        seed: of the batch.
        turn, agents: the place of the agent among those that take turns, and how many there are.
    """

    label: str
    method: str
    seed: int
    turn: int = 0
    agents: int = 1


class Searching:
    """The search of one agent of a batch.

    Attributes:
        label: of the agent.
        searcher: of the points.
        space: the space of tests.
        points: those chosen so far, by the number of the agent's episode.
        spaces: the space of each of them: the same, or that of its decisions.
    """

    def __init__(self, space: Space, order: SearchOrder, first: Sequence[Point] = ()) -> None:
        """``first``: points of the searcher's space to begin with."""
        self.space, self.label = space, order.label
        self._first, self._step = order.turn, order.agents
        seed = np.random.SeedSequence([order.seed, zlib.crc32(order.label.encode())])
        searcher = searcher_of(order.method, space, np.random.default_rng(seed))
        self.searcher = ContinuedSearch(searcher, first) if first else searcher
        self.points: list[Point] = []
        self.spaces: list[PointSpace] = []
        self._generation: list[int] = []  # episodes of the points that were asked for last
        self._told: dict[int, PlayedPoint] = {}
        self._uniform: set[int] = set()

    def ready(self, run: int) -> bool:
        """Whether the point of an episode is known."""
        number = self._number(run)
        while number >= len(self.points):
            if not all(n in self._told for n in self._generation):
                return False
            self._go_on()
        return True

    def memory(self, run: int) -> Memory:
        """The memories with which the agents play an episode whose point is known."""
        number = self._number(run)
        return self.spaces[number].memories(self.points[number])

    def told(self, row: Mapping[str, Any]) -> None:
        """Take up the row of an episode, in any order."""
        run = int(row["run"])
        if self.ready(run):
            number = self._number(run)
            self._told[number] = self._result(row)

    def best(self) -> list[tuple[PointSpace, Point]]:
        """The points that were told, with their spaces: the best of each kind, then the others."""
        ranked = sorted(self._told, key=lambda n: (-self._told[n].grade, n))
        firsts = {self._told[n].kind: n for n in reversed(ranked)}
        chosen = dict.fromkeys((*(n for n in ranked if n in firsts.values()), *ranked))
        return [(self.spaces[n], self.points[n]) for n in chosen]

    def facts(self) -> SearchFacts:
        """The findings so far."""
        numbers = sorted(self._told)
        failed = [n for n in numbers if self._told[n].failed]
        first = None
        if failed:
            first = (
                failed[0] + 1,
                math.fsum(self._told[n].seconds for n in numbers if n <= failed[0]),
            )
        played = [self.points[n] for n in numbers if self.spaces[n] is self.space]
        return SearchFacts(
            episodes=len(numbers),
            seconds=math.fsum(self._told[n].seconds for n in numbers),
            failures=len(failed),
            distinct=len({self._told[n].kind for n in failed}),
            first=first,
            words=in_common([self._failure(n) for n in failed], self.space.movements.kind.name),
            uniform=sum(n in self._uniform for n in numbers),
            covered=self.space.covered(played),
        )

    def _number(self, run: int) -> int:
        """The number of an episode among those of the agent."""
        return (run - self._first) // self._step

    def _go_on(self) -> None:
        """Tell the searcher of its last generation and ask it for the next."""
        if self._generation:
            points = [self.points[n] for n in self._generation]
            self.searcher.tell(points, [self._told[n] for n in self._generation])
        asked = self.searcher.ask()
        self._generation = list(range(len(self.points), len(self.points) + len(asked)))
        self.points += asked
        self.spaces += [self.searcher.space] * len(asked)
        if self.searcher.uniform:
            self._uniform.update(self._generation)

    def _result(self, row: Mapping[str, Any]) -> PlayedPoint:
        """The result of a point; a row of this session and one that was recorded tell the same."""
        grade, failed = graded(row)
        kind = kind_of({key: cell(row[key]) for key in FEATURES}) if failed else ()
        situations = tuple(read(cell(row["situations"])))
        return PlayedPoint(
            grade, failed, kind, situations, _body(cell(row["tester"])), _seconds(row)
        )

    def _failure(self, number: int) -> Failure:
        """The body that the ego failed in an episode."""
        played = self.spaces[number].played(self.points[number])
        place, programme = played[self._told[number].body or 0]
        others = sum(one is not None for _, one in played) - (programme is not None)
        return Failure(place, programme, others)


def _body(tester: str) -> int | None:
    """The number of the body that a row names; None if it names none of the testers."""
    return int(tester.removeprefix("tester")) if tester.startswith("tester") else None


def _seconds(row: Mapping[str, Any]) -> float:
    """How long the episode of a row lasted [s]."""
    return float(cell(row["time_s"]) or 0.0)
