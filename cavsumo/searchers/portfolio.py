"""A portfolio: searchers share the budget by what each finds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cavsumo.model.bodies import WALKING
from cavsumo.searchers.bounds import bounds_numbers
from cavsumo.searchers.decision_space import DecisionSpace
from cavsumo.searchers.evolution import EvolutionSearch
from cavsumo.searchers.explore import ExploreSearch
from cavsumo.searchers.manoeuvres import ManoeuvreSearch
from cavsumo.searchers.neighbours import NeighbourSearch
from cavsumo.searchers.protocol import PlayedPoint, PointSpace, RandomSearch, Searcher
from cavsumo.searchers.space import Point, Space
from cavsumo.searchers.tree import TreeSearch

FIRST = 3  # generations of known manoeuvres before the others take part
FORGET = 0.8  # weight of what an earlier generation found
SHARES = {
    "manoeuvres": 1.0, "neighbours": 1.6, "cma": 0.3, "random": 0.2, "tree": 0.1, "explore": 0.1,
}  # of the budget, while all find as much  # fmt: skip
PER_FAILURE = 0.3  # worth of a failure like an earlier one; a new kind counts as one more
HEIR = "neighbours"  # it goes on from what any member finds, so that is its worth too


class Portfolio:
    """Known manoeuvres first; then each generation goes to the searcher that has found most."""

    def __init__(self, space: Space, rng: np.random.Generator) -> None:
        self.rng = rng
        streams = iter(rng.spawn(6))
        known = ManoeuvreSearch(space, next(streams))
        self.members: dict[str, Searcher] = {
            "manoeuvres": known,
            "neighbours": NeighbourSearch(space, next(streams), known),
            "cma": EvolutionSearch(space, next(streams)),
            "random": RandomSearch(space, next(streams)),
        }
        if space.movements.kind.name in WALKING and not bounds_numbers(space):
            decisions = DecisionSpace(space)
            self.members["tree"] = TreeSearch(decisions, next(streams))
            self.members["explore"] = ExploreSearch(decisions, next(streams))
        self._worth = dict.fromkeys(self.members, 1.0)
        self._generation = 0
        self._turn = "manoeuvres"
        self._kinds: set[tuple[object, ...]] = set()

    @property
    def space(self) -> PointSpace:
        """The space of the last generation."""
        return self.members[self._turn].space

    @property
    def uniform(self) -> bool:
        """Whether the last generation was one of random points."""
        return self.members[self._turn].uniform

    def ask(self) -> list[Point]:
        self._turn = self._chosen()
        return self.members[self._turn].ask()

    def tell(self, points: Sequence[Point], told: Sequence[PlayedPoint]) -> None:
        self._generation += 1
        for name, member in self.members.items():
            if name == self._turn or member.space == self.space:
                member.tell(points, told)
        fresh = {t.kind for t in told if t.failed} - self._kinds
        self._kinds |= fresh
        gained = len(fresh) + PER_FAILURE * sum(t.failed for t in told)
        self._worth[self._turn] = FORGET * self._worth[self._turn] + gained
        if self._turn != HEIR and self.space == self.members[HEIR].space:
            self._worth[HEIR] += gained

    def _chosen(self) -> str:
        """The searcher of the next generation: by chance, in proportion to its worth."""
        if self._generation < FIRST:
            return "manoeuvres"
        names = list(self.members)
        weights = np.array([SHARES[n] * (0.3 + self._worth[n]) for n in names])
        return names[int(self.rng.choice(len(names), p=weights / weights.sum()))]
