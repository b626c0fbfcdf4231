"""The estimates of a batch: which random vector each episode of an exposure plays, and the result.

An estimator chooses a generation of vectors from what came of those before, in the order of their
numbers. So the digits depend on nothing but the seed and the rows, and an estimate is continued by
telling a new estimator the rows that are there.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from cavsumo.agents.casting import teams
from cavsumo.agents.names import EXPOSURE
from cavsumo.assertions.judgement import UNFAIR, VIOLATED
from cavsumo.batch.jobs import Memory
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.model.bodies import kind_named
from cavsumo.probability.encounters import Encounters, encounters_for
from cavsumo.probability.methods import estimator
from cavsumo.probability.protocol import Goal, PlayedVector
from cavsumo.probability.tree import Floats
from cavsumo.probability.vehicle_encounters import VehicleEncounters
from cavsumo.probability.weights import Estimate
from cavsumo.results.failures import ORDER, graded, violations
from cavsumo.results.rows import cell

BEYOND = 10  # vectors that are drawn together after the end of an estimate


class EventEstimate(NamedTuple):
    """The probability that an assertion is violated, or that it is in one of the ways of failures.

    Attributes:
        assertion: its name.
        kind: violated, preventable, not judged, unpreventable or unfair.
        episodes: in how many it happened, pilots included.
        found: the estimate.
    """

    assertion: str
    kind: str
    episodes: int
    found: Estimate


@dataclass(frozen=True)
class EstimateFacts:
    """The result of an estimate.

    Attributes:
        method: the estimator that was asked for.
        over: why it ended; empty if it was cut short.
        history: the estimate at each look.
        episodes, seconds: how many were played, and for how long in simulated time [s].
        errors: episodes that could not be run.
        gain: over Monte Carlo, an episode, with a 95 % interval.
        per_hour: arrivals in an hour of exposure.
        parts: the probabilities of the kinds of violation, each with an interval of its own.
    """

    method: str
    over: str
    history: tuple[Estimate, ...]
    episodes: int
    seconds: float
    errors: int
    gain: tuple[float, float, float]
    per_hour: float
    parts: tuple[EventEstimate, ...] = ()

    @property
    def found(self) -> Estimate | None:
        """The last estimate; None before the first look."""
        return self.history[-1] if self.history else None

    @property
    def refused(self) -> str:
        """Why there is no result, empty if there is one."""
        if self.errors:
            return f"{self.errors} episodes could not be run"
        if not self.over or self.found is None:
            return "it was cut short; --resume goes on"
        return self.found.refused


class Estimating:
    """The estimate of one agent of a batch.

    Attributes:
        encounters: the meaning of the vectors.
        vectors: those chosen so far, by the number of the agent's episode.
    """

    def __init__(self, prepared: PreparedBatch, label: str) -> None:
        plan = prepared.plan
        self._first, self._step = list(plan.cast).index(label), len(plan.agents)
        self.encounters = encounters_of_batch(prepared, label)
        agent: Any = prepared.cast[label].make()
        self._method = agent.method
        goal = Goal(plan.runs, agent.half_width, agent.bound or None)
        seed = np.random.SeedSequence([plan.seed, zlib.crc32(EXPOSURE.encode())])
        self._rng = np.random.default_rng(seed)
        found = self.encounters
        self._estimator = estimator(agent.method, found.dimension, goal, self._rng, found.cuts)
        self.vectors: list[Floats] = []
        self._generation = range(0)  # episodes of the vectors that were asked for last
        self._told: dict[int, PlayedVector] = {}
        self._lasted: dict[int, float] = {}
        self._errors: set[int] = set()
        self._violations: dict[int, list[tuple[str, str]]] = {}
        self._assertions = plan.scenario.assertions

    def ready(self, run: int) -> bool:
        """Whether the vector of an episode is known."""
        number = self._number(run)
        while number >= len(self.vectors):
            if not self._go_on():
                return False
        return True

    def memory(self, run: int) -> Memory:
        """The memories with which the agents play an episode whose vector is known."""
        return self.encounters.memories(self.vectors[self._number(run)])

    def told(self, row: Mapping[str, Any]) -> None:
        """Take up the row of an episode, in any order."""
        if not self.ready(int(row["run"])):
            return
        number = self._number(int(row["run"]))
        self._told[number] = played_vector(row)
        self._violations[number] = violations(row)
        self._lasted[number] = float(cell(row["time_s"]) or 0.0)
        if row["outcome"] == "error":
            self._errors.add(number)
        if len(self._told) == len(self.vectors):
            self._go_on()

    def over(self, run: int | None = None) -> str:
        """Why the estimate ends with this episode (None: with those told); empty if it goes on.

        Beside other agents it goes on with vectors by chance, so that all play equally often.
        """
        last = run is None or self._number(run) == len(self.vectors) - 1
        ends = self._step == 1 and last and len(self._told) == len(self.vectors)
        return self._estimator.over if ends else ""

    def facts(self) -> EstimateFacts:
        """The result so far."""
        return EstimateFacts(
            method=self._method,
            over=self._estimator.over,
            history=tuple(self._estimator.history),
            episodes=len(self._told),
            seconds=math.fsum(self._lasted.values()),
            errors=len(self._errors),
            gain=self._estimator.gain(),
            per_hour=self.encounters.per_hour,
            parts=tuple(self._parts()),
        )

    def _parts(self) -> Iterator[EventEstimate]:
        """Every assertion, and the kinds of its violations that happened, once it is over."""
        if not self._estimator.over:
            return
        each = [self._violations[n] for n in sorted(self._violations)]
        there = {event for events in each for event in events}
        for name in self._assertions:
            for kind in (VIOLATED, *ORDER, UNFAIR):
                if kind == VIOLATED or (name, kind) in there:
                    happened = np.array([(name, kind) in events for events in each])
                    found = self._estimator.of(happened)
                    yield EventEstimate(name, kind, int(happened.sum()), found)

    def _number(self, run: int) -> int:
        """The number of an episode among those of the agent."""
        return (run - self._first) // self._step

    def _go_on(self) -> bool:
        """Tell the estimator of its last generation and ask for the next, if that is possible."""
        if not all(n in self._told for n in self._generation):
            return False
        if self._generation and not self._estimator.over:
            self._estimator.tell([self._told[n] for n in self._generation])
            self._generation = range(0)
        if self._estimator.over and self._step == 1:
            return False
        asked = self._beyond() if self._estimator.over else self._estimator.ask()
        self._generation = range(len(self.vectors), len(self.vectors) + len(asked))
        self.vectors += list(asked)
        return True

    def _beyond(self) -> Floats:
        """Vectors by chance after the end of the estimate."""
        return self._rng.random((BEYOND, self.encounters.dimension))


def encounters_of_batch(prepared: PreparedBatch, label: str) -> Encounters | VehicleEncounters:
    """The encounters of an agent; raises InputError where its exposure has no support."""
    scenario, member = prepared.plan.scenario, prepared.cast[label]
    kind = kind_named(scenario.kind)
    return encounters_for(member.params, prepared.site, kind, teams(scenario))


def played_vector(row: Mapping[str, Any]) -> PlayedVector:
    """The result of a vector; a row of this session and one that was recorded tell the same."""
    grade, failed = graded(row)
    return PlayedVector(failed, grade)
