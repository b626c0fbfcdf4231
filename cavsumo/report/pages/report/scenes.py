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


@dataclass(frozen=True)
class BatchPlace:
    """One place, of one or several batches.

    Attributes:
        name: of its network.
        plan, site: the plan with its present files, the network with the ego's route; None if files
            are missing.
        problem: why they are missing, empty if not.
        batches: indices of its batches.
    """

    name: str
    plan: BatchPlan | None
    site: Site | None
    problem: str
    batches: list[int] = field(default_factory=list)


def scenes(batches: Sequence[Batch]) -> list[BatchPlace]:
    """The scenes of all batches, in their order; those of equal scenarios are one, wherever their
    files are.
    """
    found: dict[str, BatchPlace] = {}
    for i, batch in enumerate(batches):
        files = by_content(batch.manifest)
        key = repr((files["plan"]["scenario"], sorted(files["sha256"].items())))
        if key not in found:
            found[key] = _scene(batch)
        elif found[key].site is None:  # its files may lie beside these results
            found[key] = replace(_scene(batch), batches=found[key].batches)
        found[key].batches.append(i)
    return list(found.values())


def _scene(batch: Batch) -> BatchPlace:
    """The place of a batch: the same files, identified by their checksums."""
    name = batch.plan.scenario.name
    try:
        record = Record(batch.plan, {}, None, batch.manifest, batch.csv_file)
        plan = located(record, shown=True).plan
        return BatchPlace(name, plan, shown_site(plan, _some_trace(batch)), "")
    except CavsumoError as error:
        return BatchPlace(name, None, None, str(error))


def _some_trace(batch: Batch) -> Trace | None:
    """A trace with the box of an external ego; None for built-in egos, or without traces."""
    if is_ours(batch.plan.scenario):
        return None
    for _, row in whole_lines(batch.csv_file):
        if row is not None and row["trace"]:
            return read_trace(inside(batch.csv_file, row["trace"]))
    return None
