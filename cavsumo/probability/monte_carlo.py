"""Plain Monte Carlo with exact intervals: the default, and the judge of the others."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from cavsumo.probability.protocol import ALL_PLAYED, Goal, PlayedVector, looks
from cavsumo.probability.tree import Bools, Floats
from cavsumo.probability.weights import Estimate


@dataclass
class MonteCarlo:
    """Vectors drawn by chance; Clopper and Pearson's interval at each look."""

    dimension: int
    goal: Goal
    rng: np.random.Generator
    over: str = ""
    history: list[Estimate] = field(default_factory=list)
    played: int = 0
    failures: int = 0

    def __post_init__(self) -> None:
        self._looks = looks(self.goal.episodes, 1.0 - self.goal.level)
        self._error = 0.0  # spent at the last look

    def ask(self) -> Floats:
        return self.rng.random((self._looks[0].episodes - self.played, self.dimension))

    def tell(self, played: Sequence[PlayedVector]) -> None:
        self.played += len(played)
        self.failures += sum(one.failed for one in played)
        look = self._looks.pop(0)
        self._error = look.error
        self.history.append(exact_estimate(self.failures, self.played, look.error, self.goal.level))
        self.over = self.goal.reached(self.history[-1])
        if not self.over and not self._looks:
            self.over = ALL_PLAYED

    def of(self, happened: Bools) -> Estimate:
        count = int(happened[: self.played].sum())
        return exact_estimate(count, self.played, self._error, self.goal.level)

    def gain(self) -> tuple[float, float, float]:
        return 1.0, 1.0, 1.0


def exact_estimate(failures: int, episodes: int, error: float, level: float) -> Estimate:
    """The share of failures; its interval misses the truth at most as often as ``error`` says.

    Clopper and Pearson (1934, Biometrika 26, 404). ``level``: what the interval is said to have,
    where ``error`` is the part that is spent at this look.
    """
    from scipy.special import betaincinv

    lower = upper = 0.0
    if failures:
        lower = float(betaincinv(failures, episodes - failures + 1, error / 2))
    upper = 1.0
    if failures < episodes:
        upper = float(betaincinv(failures + 1, episodes - failures, 1 - error / 2))
    share = failures / episodes
    largest = 1.0 / failures if failures else 1.0
    return Estimate(share, lower, upper, level, episodes, failures, float(failures), largest)


def needed_without_failure(bound: float, level: float) -> int:
    """How many episodes without a failure show that the probability is at most a bound.

    As one look at a number of episodes fixed before, two-sided like the intervals:
    (1 - bound)^n <= (1 - level) / 2.
    """
    return math.ceil(math.log((1.0 - level) / 2) / math.log1p(-bound))
