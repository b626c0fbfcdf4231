"""The automatic choice: Monte Carlo, unless pilots show that failures are rare and can be aimed at.

With fewer than AIMED_FROM episodes pilots learn too little to aim, and would cost a third of them.
Failures that are frequent among the first need no other estimator. Otherwise pilots learn,
and if the last of them drew several failures, importance sampling goes on; where it is still
refused after half of the episodes, Monte Carlo takes over. The estimate never rests on the vectors
by which it was chosen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from cavsumo.probability.importance import PILOTS, Pilots, WeightedEstimation
from cavsumo.probability.monte_carlo import MonteCarlo
from cavsumo.probability.protocol import Estimator, Goal, PlayedVector
from cavsumo.probability.tree import Bools, Floats
from cavsumo.probability.weights import Estimate

AIMED_FROM = 5000  # episodes; with fewer no proposal on known functions was worth its pilots
PILOT_SHARE = 0.08
FREQUENT = 3  # failures among the first pilots: Monte Carlo does as well
FEWEST, WORTH = 2.5, 4.0  # effective failures of the last pilot, and its gain over Monte Carlo


def automatic(dimension: int, goal: Goal, rng: np.random.Generator) -> Estimator:
    """Monte Carlo for few episodes; for more of them pilots choose."""
    if goal.episodes < AIMED_FROM:
        return MonteCarlo(dimension, goal, rng)
    return Automatic(dimension, goal, rng)


@dataclass
class Automatic:
    """Pilots, then the estimator that they recommend."""

    dimension: int
    goal: Goal
    rng: np.random.Generator
    over: str = ""
    history: list[Estimate] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._each = int(PILOT_SHARE * self.goal.episodes)
        self._pilots = Pilots(self.dimension, self.rng)
        self._generations, self._spent = 0, 0
        self._weighted: WeightedEstimation | None = None
        self._plain: MonteCarlo | None = None

    def ask(self) -> Floats:
        if self._plain is not None:
            return self._plain.ask()
        return self._pilots.ask(self._each) if self._weighted is None else self._weighted.ask()

    def tell(self, played: Sequence[PlayedVector]) -> None:
        if self._plain is not None:
            self._looked(self._plain, played)
        elif self._weighted is not None:
            self._aimed(self._weighted, played)
        else:
            self._generations += 1
            self._pilots.tell(played)
            self._choose()

    def of(self, happened: Bools) -> Estimate:
        if self._plain is not None:
            found = self._plain.of(happened[self._spent :])
            return replace(found, episodes=found.episodes + self._spent)
        assert self._weighted is not None
        return self._weighted.of(happened)

    def gain(self) -> tuple[float, float, float]:
        if self._plain is not None:
            share = self._plain.played / (self._plain.played + self._spent)
            return share, share, share
        return (
            (float("nan"), 0.0, float("inf")) if self._weighted is None else self._weighted.gain()
        )

    def _choose(self) -> None:
        """Decide for an estimator once the pilots say enough."""
        last = self._pilots.last
        assert last is not None
        frequent = self._generations == 1 and self._pilots.failures >= FREQUENT
        aimed = last.effective >= FEWEST and self._pilots.gained >= WORTH
        if frequent or (self._generations == PILOTS and not aimed):
            self._go_plain(self._pilots.played)
        elif self._generations == PILOTS:
            self._weighted = WeightedEstimation(self._pilots, self.goal, self.rng)

    def _go_plain(self, spent: int) -> None:
        """Go on with Monte Carlo after so many vectors."""
        self._spent = spent
        rest = self.goal._replace(episodes=self.goal.episodes - spent)
        self._plain = MonteCarlo(self.dimension, rest, self.rng)

    def _looked(self, plain: MonteCarlo, played: Sequence[PlayedVector]) -> None:
        """A look of Monte Carlo; vectors that chose it are counted and not used."""
        plain.tell(played)
        found = plain.history[-1]
        self.history.append(replace(found, episodes=found.episodes + self._spent))
        self.over = plain.over

    def _aimed(self, aimed: WeightedEstimation, played: Sequence[PlayedVector]) -> None:
        """A look of importance sampling."""
        found = aimed.tell(played)
        if found.refused and 2 * found.episodes >= self.goal.episodes and not aimed.over:
            self._go_plain(found.episodes)
            return
        self.history.append(found)
        self.over = aimed.over
