"""Importance sampling by kernels: pilots learn where failures are, new vectors estimate how many.

The pilots choose the proposal and nothing else, so the estimate is unbiased. Its interval is that
of a mean of many terms, not exact: a kind of failure that no pilot came near is all but never
drawn. So it is refused where the weights are worth few failures or one of them carries much of the
sum, and where it contradicts the pilots.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from cavsumo.probability.kernels import Kernels, learned, uniform
from cavsumo.probability.protocol import ALL_PLAYED, Goal, PlayedVector, looks
from cavsumo.probability.tree import Bools, Floats
from cavsumo.probability.weights import Estimate, contradicts, gain_of, weighted

PILOTS, PILOT_SHARE = 4, 0.1  # of all episodes, each
CERTAIN = 0.999  # level of the pilots' interval, which the estimate must not contradict


class Pilots:
    """Vectors that learn a proposal, a generation after another.

    Attributes:
        proposal: the one learned so far.
        played: how many vectors were played.
        last, gained: the estimate of the last generation alone, and its gain over Monte Carlo.
    """

    def __init__(self, dimension: int, rng: np.random.Generator) -> None:
        self.proposal: Kernels = uniform(dimension)
        self.last: Estimate | None = None
        self.gained = 0.0
        self._rng = rng
        self._asked = np.zeros((0, dimension))
        self._vectors, self._weights = np.zeros((0, dimension)), np.zeros(0)
        self._played: list[PlayedVector] = []

    @property
    def played(self) -> int:
        """The number of vectors."""
        return len(self._played)

    @property
    def failures(self) -> int:
        """The number of failures among them."""
        return sum(one.failed for one in self._played)

    def ask(self, count: int) -> Floats:
        """The vectors of the next generation."""
        self._asked = self.proposal.draw(count, self._rng)
        return self._asked

    def tell(self, played: Sequence[PlayedVector]) -> None:
        """Learn from a generation."""
        weights = 1.0 / self.proposal.density(self._asked)
        terms = weights * np.array([one.failed for one in played])
        self.last, self.gained = weighted(terms, CERTAIN), gain_of(terms, 1.0)[0]
        self._vectors = np.append(self._vectors, self._asked, axis=0)
        self._weights = np.append(self._weights, weights)
        self._played += played
        self.proposal = learned(self._vectors, self._weights, self._played)


@dataclass
class ImportanceSampling:
    """Pilots, then an estimate with looks at fixed numbers of vectors."""

    dimension: int
    goal: Goal
    rng: np.random.Generator
    over: str = ""
    history: list[Estimate] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._each = int(PILOT_SHARE * self.goal.episodes)
        self._left = PILOTS
        self._pilots = Pilots(self.dimension, self.rng)
        self._final: WeightedEstimation | None = None

    def ask(self) -> Floats:
        if self._left:
            return self._pilots.ask(self._each)
        if self._final is None:
            self._final = WeightedEstimation(self._pilots, self.goal, self.rng)
        return self._final.ask()

    def tell(self, played: Sequence[PlayedVector]) -> None:
        if self._left:
            self._left -= 1
            self._pilots.tell(played)
            return
        assert self._final is not None
        self.history.append(self._final.tell(played))
        self.over = self._final.over

    def of(self, happened: Bools) -> Estimate:
        assert self._final is not None
        return self._final.of(happened)

    def gain(self) -> tuple[float, float, float]:
        return (float("nan"), 0.0, float("inf")) if self._final is None else self._final.gain()


class WeightedEstimation:
    """The estimate with the proposal of some pilots, from vectors of its own."""

    def __init__(self, pilots: Pilots, goal: Goal, rng: np.random.Generator) -> None:
        self.over = ""
        self._pilots, self._goal, self._rng = pilots, goal, rng
        self._looks = looks(goal.episodes - pilots.played, 1.0 - goal.level)
        self._weights, self._terms, self._error = np.zeros(0), np.zeros(0), 0.0
        self._asked = np.zeros((0, pilots.proposal.dimension))

    def ask(self) -> Floats:
        """The vectors up to the next look."""
        count = self._looks[0].episodes - len(self._terms)
        self._asked = self._pilots.proposal.draw(count, self._rng)
        return self._asked

    def tell(self, played: Sequence[PlayedVector]) -> Estimate:
        """The estimate at this look."""
        failed = np.array([one.failed for one in played])
        weights = 1.0 / self._pilots.proposal.density(self._asked)
        self._weights = np.append(self._weights, weights)
        self._terms = np.append(self._terms, failed * weights)
        self._error = self._looks.pop(0).error
        found = self._weighed(self._terms)
        pilot = self._pilots.last
        if not found.refused and pilot and not pilot.refused and contradicts(found, pilot):
            found = replace(found, refused="the estimate contradicts its last pilot")
        self.over = self._goal.reached(found)
        if not self.over and not self._looks:
            self.over = ALL_PLAYED
        return found

    def of(self, happened: Bools) -> Estimate:
        """See ``Estimator``; the first of the vectors are those of the pilots."""
        own = happened[self._pilots.played :][: len(self._weights)]
        return self._weighed(own * self._weights)

    def _weighed(self, terms: Floats) -> Estimate:
        """The estimate from terms, at the last look."""
        found = weighted(terms, 1.0 - self._error)
        episodes = self._pilots.played + len(terms)
        return replace(found, level=self._goal.level, episodes=episodes)

    def gain(self) -> tuple[float, float, float]:
        """See ``Estimator``."""
        everything = len(self._terms) + self._pilots.played
        return gain_of(self._terms, len(self._terms) / everything)
