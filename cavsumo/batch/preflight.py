"""A batch that was checked: what is played into which file, from the start or from where it is."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cavsumo.batch.prepared import OUTPUTS, PreparedBatch, manifest, prepare
from cavsumo.errors import InputError, ResultsError
from cavsumo.model.scenario import plan_from
from cavsumo.model.study import Part
from cavsumo.results.provenance import differences
from cavsumo.results.reading import check_replaceable, read_manifest
from cavsumo.results.writing import check_free


@dataclass(frozen=True)
class Manner:
    """How a run treats the results that lie there, and what it says.

    Attributes:
        resume: go on where they end.
        retry_errors: play the episodes again that could not be played.
        overwrite: start again even in place of an unfinished batch.
        quiet: no progress, no summary.
        exit_zero: a violation is no failure.
    """

    resume: bool = False
    retry_errors: bool = False
    overwrite: bool = False
    quiet: bool = False
    exit_zero: bool = False


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
    batches = [_checked(part, part.output(output), manner) for part in parts]
    for batch in batches:
        check_free(batch.output)
        if batch.recorded is None and not manner.overwrite:
            check_replaceable(batch.output)
    return batches


def _checked(part: Part, output: Path, manner: Manner) -> CheckedBatch:
    """Check one part."""
    _check_output(output)
    recorded = _recorded(output, manner)
    source = f"run: {part.name}" if part.name else "run"
    settings = {**part.defaults, **recorded_settings(recorded), **part.settings}
    prepared = prepare(plan_from(settings, source))
    prepared = prepared.without(recorded_outputs(recorded))
    now = manifest(prepared)
    different = [] if recorded is None else list(differences(recorded, now))
    if different:
        raise ResultsError(f"results {str(output)!r} are of another batch: {'; '.join(different)}")
    return CheckedBatch(part.name, output, prepared, now, recorded)


def _check_output(output: Path) -> None:
    """Refuse what cannot become a results file."""
    if not output.parent.is_dir():
        raise InputError(f"output {str(output)!r}: no such folder {str(output.parent)!r}")
    if output.suffix != ".csv":
        raise InputError(f"output {str(output)!r}: expected a name that ends in .csv")
    if output.is_dir() or output.with_suffix("").is_file():
        raise InputError(f"output {str(output)!r}: its place is taken")


def _recorded(output: Path, manner: Manner) -> dict[str, Any] | None:
    """The manifest of the batch to go on with, None for a new one.

    With ``resume`` there may be nothing yet, so that the same command starts and goes on.
    """
    if not (manner.resume or manner.retry_errors):
        return None
    rows = output.is_file() and output.stat().st_size > 0
    if manner.resume and not rows and not output.with_suffix(".json").exists():
        return None  # a kill may leave an empty file
    return read_manifest(output)


def recorded_outputs(recorded: Mapping[str, Any] | None) -> list[str]:
    """The files that the ego of a recorded batch wrote."""
    return [str(name) for name in (recorded or {}).get(OUTPUTS) or ()]


def recorded_settings(recorded: Mapping[str, Any] | None) -> dict[str, Any]:
    """The settings of a recorded plan; what is not given again stays as it was."""
    if recorded is None:
        return {}
    try:
        plan = dict(recorded["plan"])
        flat = {"routes": "none"} | {k: v for k, v in plan.pop("scenario").items() if v is not None}
        return flat | {k: v for k, v in plan.items() if v is not None}
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ResultsError("the manifest holds no plan to go on with") from error
