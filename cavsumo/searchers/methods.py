"""The searchers by the names under which they are chosen."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from cavsumo.searchers.evolution import EvolutionSearch
from cavsumo.searchers.manoeuvres import ManoeuvreSearch
from cavsumo.searchers.neighbours import NeighbourSearch
from cavsumo.searchers.portfolio import Portfolio
from cavsumo.searchers.protocol import RandomSearch, Searcher
from cavsumo.searchers.space import Space


def _neighbours(space: Space, rng: np.random.Generator) -> Searcher:
    first, own = rng.spawn(2)
    return NeighbourSearch(space, own, ManoeuvreSearch(space, first))


SEARCHERS: Mapping[str, Callable[[Space, np.random.Generator], Searcher]] = {
    "portfolio": Portfolio,
    "random": RandomSearch,
    "manoeuvres": ManoeuvreSearch,
    "neighbours": _neighbours,
    "cma": EvolutionSearch,
}


def searcher_of(method: str, space: Space, rng: np.random.Generator) -> Searcher:
    """The searcher of a method."""
    return SEARCHERS[method](space, rng)
