"""The searches of a batch: which point each episode of a searching agent plays.

A searcher chooses a generation of points from what came of the generations before, in the order of
their numbers. So the points depend on nothing but the seed and the rows, and a batch is continued
by telling a new searcher the rows that are there.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cavsumo.agents.casting import teams
from cavsumo.batch.jobs import Memory
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.model.bodies import kind_named
from cavsumo.results.grade import INVALID_GRADE
from cavsumo.results.rows import cell
from cavsumo.searchers.methods import searcher_of
from cavsumo.searchers.protocol import PlayedPoint
from cavsumo.searchers.space import Point, Space, space_of
from cavsumo.searchers.words import in_common

SPEED_BIN_MPS, PLACE_BIN_M = 2.0, 10.0  # failures within a bin are alike


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


class Searching:
    """The search of one agent of a batch.

    Attributes:
        label: of the agent.
        space: the space of tests.
        points: those chosen so far, by the number of the agent's episode.
    """

    def __init__(self, prepared: PreparedBatch, label: str) -> None:
        plan = prepared.plan
        self.label, self._step = label, len(plan.agents)
        self._first = list(plan.cast).index(label)
        self.space = space_of_batch(prepared)
        seed = np.random.SeedSequence([plan.seed, zlib.crc32(label.encode())])
        method = str(prepared.cast[label].params.get("method", "portfolio"))
        self._searcher = searcher_of(method, self.space, np.random.default_rng(seed))
        self.points: list[Point] = []
        self._generation: list[int] = []  # episodes of the points that were asked for last
        self._told: dict[int, PlayedPoint] = {}
        self._lasted: dict[int, float] = {}
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
        return self.space.memories(self.points[self._number(run)])

    def told(self, row: Mapping[str, Any]) -> None:
        """Take up the row of an episode, in any order."""
        run = int(row["run"])
        if self.ready(run):
            number = self._number(run)
            self._told[number] = self._result(self.points[number], row)
            self._lasted[number] = float(cell(row["time_s"]) or 0.0)

    def facts(self) -> SearchFacts:
        """The findings so far."""
        numbers = sorted(self._told)
        failed = [n for n in numbers if self._told[n].failed]
        first = None
        if failed:
            first = failed[0] + 1, math.fsum(self._lasted[n] for n in numbers if n <= failed[0])
        played = [self.points[n] for n in numbers]
        return SearchFacts(
            episodes=len(numbers),
            seconds=math.fsum(self._lasted.values()),
            failures=len(failed),
            distinct=len({self._told[n].kind for n in failed}),
            first=first,
            words=in_common([self.space.seen(self.points[n])[0] for n in failed]),
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
            self._searcher.tell(points, [self._told[n] for n in self._generation])
        asked = self._searcher.ask()
        self._generation = list(range(len(self.points), len(self.points) + len(asked)))
        self.points += asked
        if self._searcher.uniform:
            self._uniform.update(self._generation)

    def _result(self, point: Point, row: Mapping[str, Any]) -> PlayedPoint:
        """The result of a point; a row of this session and one that was recorded tell the same."""
        text = {key: cell(row[key]) for key in ("grade", "outcome", "avoidable", "tester")}
        grade = float(text["grade"]) if text["grade"] else INVALID_GRADE
        failed = text["outcome"] == "violated" and text["avoidable"] != "0" and grade >= 0.0
        return PlayedPoint(
            grade, failed, self._kind(point, text["tester"], grade) if failed else ()
        )

    def _kind(self, point: Point, tester: str, impact: float) -> tuple[object, ...]:
        """Impact speed, side and place of a failure, by which failures are alike."""
        number = int(tester.removeprefix("tester")) if tester.startswith("tester") else 0
        place = self.space.place(point, number)
        return impact // SPEED_BIN_MPS, place.left, place.along // PLACE_BIN_M


def space_of_batch(prepared: PreparedBatch) -> Space:
    """The space of the tests of a batch; raises InputError where it holds no start."""
    scenario = prepared.plan.scenario
    return space_of(prepared.site, kind_named(scenario.kind), teams(scenario))
