"""CMA-ES with restarts (the package ``cma``)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cavsumo.searchers.protocol import GENERATION, PlayedPoint
from cavsumo.searchers.space import Point, Space

SIGMA = 0.22
STALE = 10  # generations without progress before a restart
PROGRESS = 0.01


class EvolutionSearch:
    """Covariance matrix adaptation from a random point, or the best one of others, and again."""

    uniform = False

    def __init__(self, space: Space, rng: np.random.Generator) -> None:
        self.space, self.rng = space, rng
        self._best, self._stale = -np.inf, 0
        self._strategy: Any = None  # not begun: the package takes a second to import
        self._asked: Sequence[Any] = ()
        self._others: tuple[float, Point] | None = None  # the best point of another searcher

    def ask(self) -> list[Point]:
        if self._strategy is None or self._stale >= STALE or self._strategy.stop():
            self._strategy = self._begun()
            self._best, self._stale = -np.inf, 0
        self._asked = self._strategy.ask()
        return [np.clip(np.asarray(x, dtype=float), 0.0, 1.0) for x in self._asked]

    def tell(self, points: Sequence[Point], told: Sequence[PlayedPoint]) -> None:
        grades = [t.grade for t in told]
        if not self._asked:
            i = int(np.argmax(grades))
            if self._others is None or grades[i] > self._others[0]:
                self._others = grades[i], points[i]
            return
        self._strategy.tell(self._asked, [-g for g in grades])
        self._asked = ()
        better = max(grades) > self._best + PROGRESS
        self._best = max(self._best, *grades)
        self._stale = 0 if better else self._stale + 1

    def _begun(self) -> Any:
        """A strategy that begins at the best point of others, if there is one, or a random one."""
        import cma

        random = self.rng.random(self.space.dimension)
        first = np.clip(random if self._others is None else self._others[1], 0.02, 0.98)
        self._others = None
        options: dict[str, Any] = {
            "bounds": [0.0, 1.0],
            "popsize": GENERATION,
            "seed": np.nan,  # the numbers come from ``randn`` alone
            "randn": lambda *shape: self.rng.standard_normal(shape),
            "verbose": -9,
            "verb_disp": 0,
            "verb_log": 0,
        }
        return cma.CMAEvolutionStrategy(first, SIGMA, options)
