"""The searches of a batch, begun: anew, or with the best points of an earlier search."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from cavsumo.agents.casting import params_of
from cavsumo.agents.names import SEARCH
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.batch.searching import Searching, SearchOrder
from cavsumo.errors import ResultsError
from cavsumo.model.scenario import BatchPlan
from cavsumo.results.provenance import unequal, versions
from cavsumo.results.reading import rows_of
from cavsumo.results.recorded_plan import recorded_plan
from cavsumo.searchers.bounds import bounded, within_of
from cavsumo.searchers.continued import SPACE, fingerprint
from cavsumo.searchers.diversity import check_installed
from cavsumo.searchers.methods import DIVERSITY, method_of, packages_of
from cavsumo.searchers.protocol import GENERATION

EARLIER = 2 * GENERATION  # points of an earlier search
SETTINGS = ("net", "kind", "testers", "bodies_per_agent", "start_speed")  # said of another space


def search_of(prepared: PreparedBatch, label: str) -> Searching:
    """The search of one agent; raises ResultsError where an earlier one is of another space."""
    return _search(prepared, prepared.plan, label, ())


def check_earlier(prepared: PreparedBatch) -> None:
    """Raise ResultsError where a search of a batch cannot begin with the earlier one it names."""
    for member in prepared.cast:
        if member.searches and member.params.get("earlier"):
            search_of(prepared, member.label)


def _search(
    prepared: PreparedBatch, plan: BatchPlan, label: str, later: tuple[Path, ...]
) -> Searching:
    """The search of an agent of a plan in the space of a batch.

    ``later``: the files of the searches that begin with this one.
    """
    params = params_of(plan, label)
    turn, agents = list(plan.cast).index(label), len(plan.agents)
    order = SearchOrder(label, method_of(params), plan.seed, turn, agents)
    space = bounded(prepared.space, within_of(params))
    search = Searching(space, order)
    if not params.get("earlier"):
        return search
    file = prepared.plan.scenario.present(Path(str(params["earlier"])))
    if file in later:
        raise ResultsError(f"search.earlier {str(file)!r}: begins with itself")
    earlier = _earlier(prepared, file, later, within_of(params))
    sort = type(search.searcher.space)
    points = [point for space, point in earlier.best() if type(space) is sort]
    return Searching(space, order, points[:EARLIER])


def _earlier(
    prepared: PreparedBatch, file: Path, later: tuple[Path, ...], within: str
) -> Searching:
    """An earlier search of the same space within the same bounds, told of its rows."""
    plan, manifest = recorded_plan(file)
    labels = [label for label, name in plan.cast.items() if name == SEARCH]
    if not labels:
        raise ResultsError(f"search.earlier {str(file)!r}: holds no search, only {plan.agents[0]}")
    _check(prepared, plan, manifest, f"search.earlier {str(file)!r}")
    was = within_of(params_of(plan, labels[0]))
    if was != within:
        raise ResultsError(
            f"search.earlier {str(file)!r}: is of another space: search.within was {was!r}, is "
            f"{within!r}"
        )
    search = _search(prepared, plan, labels[0], (*later, file))
    _tell(search, rows_of(file))
    return search


def _tell(search: Searching, rows: Iterable[Mapping[str, Any]]) -> None:
    """Tell a search of the rows of its agent."""
    for row in rows:
        if row["agent"] == search.label:
            search.told(row)


def _check(
    prepared: PreparedBatch, plan: BatchPlan, manifest: Mapping[str, Any], name: str
) -> None:
    """Refuse an earlier search of another space, or of a version that chose other points."""
    methods = [method_of(params_of(plan, k)) for k, agent in plan.cast.items() if agent == SEARCH]
    if DIVERSITY in methods:
        check_installed()
    for package, (was, is_) in unequal(manifest["versions"], versions(packages_of(methods))):
        if was is None:
            continue  # results of before it was recorded
        raise ResultsError(f"{name}: its points were chosen with {package} {was}, not {is_}")
    if manifest["sha256"].get(SPACE) == fingerprint(prepared.space):
        return
    for key in SETTINGS:
        was, is_ = getattr(plan.scenario, key), getattr(prepared.plan.scenario, key)
        if was != is_:
            raise ResultsError(f"{name}: is of another space: {key} was {was}, is {is_}")
    raise ResultsError(
        f"{name}: is of another space: the network, the ego's route or box, or how often the ego "
        "decides was another one"
    )
