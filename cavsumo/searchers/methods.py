"""The searchers by the names under which they are chosen."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from cavsumo.agents.names import SEARCH_METHODS
from cavsumo.errors import InputError
from cavsumo.model.bodies import WALKING
from cavsumo.searchers.bounds import MEETS, SIDE, bounds_numbers
from cavsumo.searchers.decision_space import DecisionSpace
from cavsumo.searchers.diversity import DiversitySearch, check_installed
from cavsumo.searchers.evolution import EvolutionSearch
from cavsumo.searchers.explore import ExploreSearch
from cavsumo.searchers.manoeuvres import ManoeuvreSearch
from cavsumo.searchers.neighbours import NeighbourSearch
from cavsumo.searchers.portfolio import Portfolio
from cavsumo.searchers.protocol import RandomSearch, Searcher
from cavsumo.searchers.space import Space
from cavsumo.searchers.tree import TreeSearch

BY_DECISIONS, DIVERSITY = ("tree", "explore"), "diversity"
# Packages that choose points, besides numpy.
PACKAGES = {"portfolio": ("cma",), "cma": ("cma",), DIVERSITY: ("cma", "ribs")}


def _neighbours(space: Space, rng: np.random.Generator) -> Searcher:
    first, own = rng.spawn(2)
    return NeighbourSearch(space, own, ManoeuvreSearch(space, first))


def _diversity(space: Space, rng: np.random.Generator) -> Searcher:
    first, own = rng.spawn(2)
    return DiversitySearch(space, own, ManoeuvreSearch(space, first))


SEARCHERS: Mapping[str, Callable[[Space, np.random.Generator], Searcher]] = {
    "portfolio": Portfolio,
    "random": RandomSearch,
    "manoeuvres": ManoeuvreSearch,
    "neighbours": _neighbours,
    "cma": EvolutionSearch,
    DIVERSITY: _diversity,
    "tree": lambda space, rng: TreeSearch(DecisionSpace(space), rng),
    "explore": lambda space, rng: ExploreSearch(DecisionSpace(space), rng),
}


def searcher_of(method: str, space: Space, rng: np.random.Generator) -> Searcher:
    """The searcher of a method."""
    return SEARCHERS[method](space, rng)


def method_of(params: Mapping[str, Any]) -> str:
    """The method of a search, from the parameters of its agent."""
    return str(params.get("method", SEARCH_METHODS[0]))


def packages_of(methods: Iterable[str]) -> list[str]:
    """The packages that choose the points of these methods, besides numpy."""
    return sorted({package for method in methods for package in PACKAGES.get(method, ())})


def check_method(method: str, space: Space) -> None:
    """Raise InputError where a method cannot search a space."""
    if method == DIVERSITY:
        check_installed()
    if method in BY_DECISIONS and bounds_numbers(space):
        raise InputError(
            f"search.method {method}: decides anew every second, so of search.within it can keep "
            f"{SIDE} and {MEETS} alone; choose another method"
        )
    if method in BY_DECISIONS and space.movements.kind.name not in WALKING:
        raise InputError(
            f"search.method {method}: decides for {' and '.join(WALKING)}s alone; choose another "
            f"method for kind {space.movements.kind.name!r}"
        )
