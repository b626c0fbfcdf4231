"""The check of a batch: its plan and its file, new or continued."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cavsumo.batch.manner import Manner
from cavsumo.batch.planned import PlannedBatch, planned
from cavsumo.batch.prepared import OUTPUTS, PreparedBatch, manifest, prepare
from cavsumo.batch.searches import check_earlier
from cavsumo.errors import ResultsError
from cavsumo.model.study import Part
from cavsumo.results.provenance import differences
from cavsumo.results.reading import read_manifest

UNESSENTIAL = frozenset({"deadline_s"})  # settings without influence on rows that are no errors


@dataclass(frozen=True)
class CheckedBatch:
    """A batch ready to be played.

    Attributes:
        name: its name in a study; empty for none.
        output: its results file.
        prepared, manifest: what is played.
        recorded: the manifest of the batch to go on with, None for a new one.
        replaced: how many episodes of another finished batch lie in its place.
    """

    name: str
    output: Path
    prepared: PreparedBatch
    manifest: Mapping[str, Any]
    recorded: Mapping[str, Any] | None
    replaced: int = 0

    def without(self, outputs: Sequence[str]) -> CheckedBatch:
        """The same batch, with some files as outputs of its ego."""
        prepared = self.prepared.without(outputs)
        return dataclasses.replace(
            self,
            prepared=prepared,
            manifest={**self.manifest, "sha256": manifest(prepared)["sha256"]},
        )


def checked(
    parts: Sequence[Part],
    output: Path,
    manner: Manner,
    places: Mapping[str, Path] | None = None,
) -> list[CheckedBatch]:
    """Check all batches of a run before any is played; raises InputError in one sentence.

    ``places``: the present paths of files that the parts name (``Scenario.placed``).
    """
    return prepared_batches(planned(parts, output, manner, places), manner)


def prepared_batches(batches: Sequence[PlannedBatch], manner: Manner) -> list[CheckedBatch]:
    """The planned batches with all that their processes need."""
    return [_in_place(batch, manner) for batch in [_checked(batch) for batch in batches]]


def _in_place(batch: CheckedBatch, manner: Manner) -> CheckedBatch:
    """A batch whose place may be taken: by going on, or instead of what lies there."""
    if batch.recorded is not None:
        return batch
    other = other_batch(batch.output, batch.manifest)
    if other is None:
        return batch
    if not (manner.overwrite or manner.scratch):
        raise _kept(batch.output, other, batch.manifest)
    return dataclasses.replace(batch, replaced=episodes_of(other))


def check_kept(output: Path, manifest: Mapping[str, Any]) -> None:
    """Raise ResultsError where another finished batch lies in a file that the user named."""
    other = other_batch(output, manifest)
    if other is not None:
        raise _kept(output, other, manifest)


def _kept(output: Path, other: Mapping[str, Any], manifest: Mapping[str, Any]) -> ResultsError:
    """The error for another finished batch, which names a difference."""
    different = next(differences(other, manifest, apart=UNESSENTIAL))
    return ResultsError(
        f"results {str(output)!r}: hold another finished batch of {episodes_of(other)} "
        f"episodes ({different}); --overwrite replaces it"
    )


def other_batch(output: Path, manifest: Mapping[str, Any]) -> dict[str, Any] | None:
    """The manifest of another batch that has rows in a file; None where the same one has."""
    if not (output.is_file() and output.stat().st_size > 0):
        return None
    try:
        there = read_manifest(output)
    except ResultsError:  # to be replaced although it is no batch
        return None
    other = any(differences(there, manifest, apart=UNESSENTIAL))
    return there if other and episodes_of(there) else None


def episodes_of(manifest: Mapping[str, Any]) -> int:
    """How many episodes a finished batch has."""
    count = manifest.get("episodes")
    return count if isinstance(count, int) else 0


def _checked(batch: PlannedBatch) -> CheckedBatch:
    """Check and prepare one batch."""
    recorded, output = batch.recorded, batch.output
    prepared = prepare(batch.plan).without(recorded_outputs(recorded))
    now = manifest(prepared)
    different = [] if recorded is None else list(differences(recorded, now))
    if different:
        raise ResultsError(f"results {str(output)!r} are of another batch: {'; '.join(different)}")
    for label, learned in (recorded or {}).get("learned", {}).items():
        if label in prepared.cast.learners:
            source = f"manifest of {str(output)!r}: learned"
            prepared.cast.check_memory(label, learned, source)
    check_earlier(prepared)
    return CheckedBatch(batch.name, output, prepared, now, recorded)


def recorded_outputs(recorded: Mapping[str, Any] | None) -> list[str]:
    """The files that the ego of a recorded batch wrote."""
    return [str(name) for name in (recorded or {}).get(OUTPUTS) or ()]
