"""Quality diversity: the best point of every cell of impact speed, side, place and manner.

CMA-ME (Fontaine et al., arXiv 1912.02400) by the package ``ribs``: emitters adapt the covariance of
their points to what fills cells or improves them.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any

import numpy as np

from cavsumo.errors import InputError
from cavsumo.searchers.protocol import GENERATION, PlayedPoint, Searcher
from cavsumo.searchers.space import STRETCH_M, Point, Space

FIRST = 2  # generations of another searcher, from whose best points the emitters begin
EMITTERS = 2
SIGMA = 0.15
IMPACT_MPS, IMPACTS = 2.0, 5  # cells of impact speed, besides the one of no preventable failure


class DiversitySearch:
    """An archive of cells, and emitters that fill it."""

    uniform = False

    def __init__(self, space: Space, rng: np.random.Generator, first: Searcher) -> None:
        self.space, self.rng, self.first = space, rng, first
        stretches = {(p.whence, p.along // STRETCH_M) for p in space.movements.places}
        self._stretches = {one: i for i, one in enumerate(sorted(stretches))}
        self._generation = 0
        self._archive = self._empty()
        self._scheduler: Any = None  # not begun
        self._asked = False  # whether the emitters chose the points that are told next

    def ask(self) -> list[Point]:
        self._asked = self._generation >= FIRST
        if not self._asked:
            return self.first.ask()
        if self._scheduler is None:
            self._scheduler = self._emitters()
        return [np.clip(point, 0.0, 1.0) for point in self._scheduler.ask()]

    def tell(self, points: Sequence[Point], told: Sequence[PlayedPoint]) -> None:
        self._generation += 1
        grades = np.array([one.grade for one in told])
        cells = np.array([self._cell(*one) for one in zip(points, told, strict=True)], dtype=float)
        if self._asked and self._scheduler is not None:
            self._scheduler.tell(grades, cells)
        else:
            self._archive.add(np.array(points), grades, cells)
        self._asked = False

    def _cell(self, point: Point, result: PlayedPoint) -> tuple[int, ...]:
        """The cell of a point: impact speed, side and place, manner of the first body."""
        place = self.space.place(point, 0)
        impact = 1 + min(IMPACTS - 1, int(result.grade // IMPACT_MPS)) if result.failed else 0
        stretch = self._stretches[place.whence, place.along // STRETCH_M]
        return impact, stretch, *self.space.manner(point)

    def _empty(self) -> Any:
        """An archive without points."""
        from ribs.archives import GridArchive

        dims = (1 + IMPACTS, len(self._stretches), *(3 for _ in self.space.movements.manner))
        return GridArchive(
            solution_dim=self.space.dimension,
            dims=dims,
            ranges=[(-0.5, size - 0.5) for size in dims],
            seed=self._seed(),
        )

    def _emitters(self) -> Any:
        """Emitters that begin at the best points so far."""
        from ribs.emitters import EvolutionStrategyEmitter
        from ribs.schedulers import Scheduler

        elites = self._archive.data(["solution", "objective"])
        best = elites["solution"][np.argsort(-elites["objective"], kind="stable")]
        emitters = [
            EvolutionStrategyEmitter(
                self._archive,
                x0=best[i % len(best)],
                sigma0=SIGMA,
                ranker="2imp",
                es="pycma_es",  # with its own random numbers, and nothing to compile
                batch_size=GENERATION // EMITTERS,
                lower_bounds=np.zeros(self.space.dimension),
                upper_bounds=np.ones(self.space.dimension),
                seed=self._seed(),
            )
            for i in range(EMITTERS)
        ]
        return Scheduler(self._archive, emitters)

    def _seed(self) -> int:
        """A seed for the package."""
        return int(self.rng.integers(2**31))


def check_installed() -> None:
    """Raise InputError unless the package is there."""
    if find_spec("ribs") is None:
        raise InputError("search.method diversity needs ribs: pip install 'cavsumo[search]'")
