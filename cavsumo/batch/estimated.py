"""The estimates in results files: the same facts as at the end of the batch that played them."""

from __future__ import annotations

from pathlib import Path

from cavsumo.agents.names import EXPOSURE
from cavsumo.batch.estimating import EstimateFacts, Estimating, played_vector
from cavsumo.batch.prepared import prepare
from cavsumo.errors import ResultsError
from cavsumo.probability.ratio import Ratio, ratio_of
from cavsumo.results.reading import rows_of
from cavsumo.results.recorded_plan import recorded_plan


def estimated(csv_file: Path) -> EstimateFacts:
    """The result of the estimate in a results file."""
    plan, _ = recorded_plan(csv_file)
    if list(plan.cast.values()) != [EXPOSURE]:
        raise ResultsError(f"results {str(csv_file)!r}: hold no estimate")
    found = Estimating(prepare(plan), next(iter(plan.cast)))
    for row in rows_of(csv_file):
        found.told(row)
    return found.facts()


def compared(first: Path, second: Path) -> Ratio:
    """The ratio of the failure probabilities of two results with common random numbers."""
    failed = [
        {
            row["run"]: played_vector(row).failed
            for row in rows_of(file)
            if row["outcome"] != "error"
        }
        for file in (first, second)
    ]
    runs = [run for run in failed[0] if run in failed[1]]
    return ratio_of([failed[0][run] for run in runs], [failed[1][run] for run in runs])
