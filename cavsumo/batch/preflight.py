"""A batch that was checked: what is played into which file, from the start or from where it is."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cavsumo.batch.manner import Manner
from cavsumo.batch.planned import PlannedBatch, planned
from cavsumo.batch.prepared import OUTPUTS, PreparedBatch, manifest, prepare
from cavsumo.errors import ResultsError
from cavsumo.model.study import Part
from cavsumo.results.provenance import differences


@dataclass(frozen=True)
class CheckedBatch:
    """A batch ready to be played.

    Attributes:
        name: which part of a study it is; empty for none.
        output: its results file.
        prepared, manifest: what is played.
        recorded: the manifest of the batch to go on with, None for a new one.
    """

    name: str
    output: Path
    prepared: PreparedBatch
    manifest: Mapping[str, Any]
    recorded: Mapping[str, Any] | None

    def without(self, outputs: Sequence[str]) -> CheckedBatch:
        """The same batch, but some files are what its ego writes."""
        prepared = self.prepared.without(outputs)
        return dataclasses.replace(
            self,
            prepared=prepared,
            manifest={**self.manifest, "sha256": manifest(prepared)["sha256"]},
        )


def checked(parts: Sequence[Part], output: Path, manner: Manner) -> list[CheckedBatch]:
    """Check all parts of a run before any is played; raises InputError in one sentence."""
    return prepared_batches(planned(parts, output, manner))


def prepared_batches(batches: Sequence[PlannedBatch]) -> list[CheckedBatch]:
    """The batches that were planned, with all that their processes need."""
    return [_checked(batch) for batch in batches]


def _checked(batch: PlannedBatch) -> CheckedBatch:
    """Check and prepare one batch."""
    recorded, output = batch.recorded, batch.output
    prepared = prepare(batch.plan).without(recorded_outputs(recorded))
    now = manifest(prepared)
    different = [] if recorded is None else list(differences(recorded, now))
    if different:
        raise ResultsError(f"results {str(output)!r} are of another batch: {'; '.join(different)}")
    return CheckedBatch(batch.name, output, prepared, now, recorded)


def recorded_outputs(recorded: Mapping[str, Any] | None) -> list[str]:
    """The files that the ego of a recorded batch wrote."""
    return [str(name) for name in (recorded or {}).get(OUTPUTS) or ()]
