"""The places of the batches of a report, if their files are available."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from cavsumo.batch.located import located
from cavsumo.batch.replay import Record
from cavsumo.batch.shown import is_ours, shown_site
from cavsumo.errors import CavsumoError
from cavsumo.model.scenario import BatchPlan
from cavsumo.network.site import Site
from cavsumo.report.grouping import by_content
from cavsumo.report.load import Batch
from cavsumo.results.reading import inside, whole_lines
from cavsumo.results.traces import Trace, read_trace
from cavsumo.suites.cases import case_plan, cases_of


@dataclass(frozen=True)
class BatchPlace:
    """One place, of one or several batches, or of the cases of a suite on one network.

    Attributes:
        name: of its network.
        plan, site: the plan with its present files, the network with the ego's route; None if files
            are missing.
        problem: why they are missing, empty if not.
        batches: indices of its batches.
        runs: numbers of its runs; None for all of its batches.
    """

    name: str
    plan: BatchPlan | None
    site: Site | None
    problem: str
    batches: list[int] = field(default_factory=list)
    runs: frozenset[int] | None = None

    def has(self, batch: int, run: int) -> bool:
        """Whether a run of a batch is here."""
        return batch in self.batches and (self.runs is None or run in self.runs)


def scenes(batches: Sequence[Batch]) -> list[BatchPlace]:
    """The scenes of all batches, in their order; those of equal scenarios are one, wherever their
    files are.
    """
    found: dict[str, BatchPlace] = {}
    for i, batch in enumerate(batches):
        files = by_content(batch.manifest)
        whole = repr((files["plan"]["scenario"], sorted(files["sha256"].items())))
        for net, runs in _runs_by_net(batch).items():
            key = f"{whole} {net}"
            if key not in found:
                found[key] = _scene(batch, runs)
            elif found[key].site is None:  # its files may lie beside these results
                found[key] = replace(_scene(batch, runs), batches=found[key].batches)
            found[key].batches.append(i)
    return list(found.values())


def _runs_by_net(batch: Batch) -> dict[str, list[int] | None]:
    """The runs on each network of a suite; one network with all runs for any other batch."""
    if batch.plan.suite is None:
        return {"": None}
    try:
        return {**cases_of(batch.plan).runs_by_net()}
    except CavsumoError:  # the suite is gone, and is missed when its scene is made
        return {"": None}


def _scene(batch: Batch, runs: list[int] | None) -> BatchPlace:
    """The place of some runs of a batch: the same files, identified by their checksums."""
    name, here = batch.plan.scenario.name, None if runs is None else frozenset(runs)
    try:
        plan = case_plan(batch.plan, runs[0] if runs else 0)
        name = plan.scenario.name
        record = Record(plan, {}, None, batch.manifest, batch.csv_file)
        plan = located(record, shown=True).plan
        return BatchPlace(name, plan, shown_site(plan, _some_trace(batch)), "", runs=here)
    except CavsumoError as error:
        return BatchPlace(name, None, None, str(error), runs=here)


def _some_trace(batch: Batch) -> Trace | None:
    """A trace with the box of an external ego; None for built-in egos, or without traces."""
    scenario = case_plan(batch.plan, 0).scenario
    if scenario.script is not None or is_ours(scenario):
        return None
    for _, row in whole_lines(batch.csv_file):
        if row is not None and row["trace"]:
            return read_trace(inside(batch.csv_file, row["trace"]))
    return None
