"""The searches of a batch, begun: anew, or with the best points of an earlier search."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from cavsumo.agents.casting import resolve_cast
from cavsumo.agents.names import SEARCH
from cavsumo.batch.jobs import Memory
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.batch.searching import Searching
from cavsumo.errors import ResultsError
from cavsumo.model.scenario import BatchPlan
from cavsumo.results.reading import rows_of
from cavsumo.results.recorded_plan import recorded_plan
from cavsumo.searchers.protocol import GENERATION
from cavsumo.searchers.space import Point

EARLIER = 2 * GENERATION  # points of an earlier search
SPACE = ("kind", "testers", "bodies_per_agent")  # settings that decide the space, besides the place


def search_of(prepared: PreparedBatch, label: str) -> Searching:
    """The search of one agent; raises ResultsError where an earlier one is of another space."""
    earlier = prepared.cast[label].params.get("earlier")
    if not earlier:
        return Searching(prepared, label)
    sort = type(Searching(prepared, label).searcher.space)
    points = [point for space, point in _best(prepared, Path(str(earlier))) if type(space) is sort]
    return Searching(prepared, label, points[:EARLIER])


def check_earlier(prepared: PreparedBatch) -> None:
    """Raise ResultsError where a search of a batch cannot begin with the earlier one it names."""
    for label in sorted(prepared.cast.searchers):
        search_of(prepared, label)


def searched(
    prepared: PreparedBatch, label: str, rows: Iterable[Mapping[str, Any]], run: int
) -> Memory:
    """The memories with which the agents of a search played an episode, from the rows before it.

    Raises ResultsError where rows are missing.
    """
    search = search_of(prepared, label)
    _tell(search, (row for row in rows if int(row["run"]) < run))
    if not search.ready(run):
        raise ResultsError(f"run {run} cannot be found again: rows of the search before it miss")
    return search.memory(run)


def _best(prepared: PreparedBatch, file: Path) -> list[tuple[Any, Point]]:
    """The points of an earlier search with their spaces: the best of each kind, then the others."""
    plan, manifest = recorded_plan(file)
    labels = [label for label, name in plan.cast.items() if name == SEARCH]
    if not labels:
        raise ResultsError(f"search.earlier {str(file)!r}: holds no search, only {plan.agents[0]}")
    _check_space(prepared, plan, manifest, file)
    then = dataclasses.replace(prepared, plan=plan, cast=resolve_cast(plan))
    search = search_of(then, labels[0])
    _tell(search, rows_of(file))
    return search.best()


def _tell(search: Searching, rows: Iterable[Mapping[str, Any]]) -> None:
    """Tell a search of the rows of its agent."""
    for row in rows:
        if row["agent"] == search.label:
            search.told(row)


def _check_space(
    prepared: PreparedBatch, plan: BatchPlan, manifest: Mapping[str, Any], file: Path
) -> None:
    """Refuse an earlier search with other bodies or at another place."""
    name, own = f"search.earlier {str(file)!r}", prepared.plan.scenario
    for key in SPACE:
        was, is_ = getattr(plan.scenario, key), getattr(own, key)
        if was != is_:
            raise ResultsError(f"{name}: is of another space: {key} was {was!r}, is {is_!r}")
    nets = (manifest["sha256"].get(str(plan.scenario.net)), prepared.checksums.get(str(own.net)))
    if nets[0] != nets[1]:
        raise ResultsError(f"{name}: is of another network, {plan.scenario.net}, not {own.net}")
    routes = list(manifest["ego_route"]), list(prepared.site.route.edges)
    if routes[0] != routes[1]:
        was, is_ = (" ".join(route) for route in routes)
        raise ResultsError(f"{name}: is of another route of the ego, {was}, not {is_}")
