"""The check of a batch: its plan and its file, new or continued."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cavsumo.agents.policy import policy_file
from cavsumo.batch.located import present_paths
from cavsumo.batch.prepared import OUTPUTS, PreparedBatch, manifest, prepare
from cavsumo.batch.replay import Record
from cavsumo.errors import InputError, ResultsError
from cavsumo.model.labels import cast_of
from cavsumo.model.scenario import BatchPlan, plan_from
from cavsumo.model.study import Part
from cavsumo.results.provenance import differences, input_files
from cavsumo.results.reading import check_replaceable, read_manifest
from cavsumo.results.writing import check_free

UNESSENTIAL = frozenset({"deadline_s"})  # settings without influence on rows that are no errors


@dataclass(frozen=True)
class Manner:
    """How a run treats existing results, and what it prints.

    Attributes:
        resume: go on where they end.
        retry_errors: play the episodes again that could not be played.
        overwrite: start again even in place of an unfinished batch, or of another finished one.
        scratch: the results file is not one that the user named: a finished batch there is
            replaced, and that is said.
        quiet: no progress, no summary.
        exit_zero: exit with 0 after a violation.
    """

    resume: bool = False
    retry_errors: bool = False
    overwrite: bool = False
    scratch: bool = False
    quiet: bool = False
    exit_zero: bool = False


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

    ``places``: the present paths of files, by the names that the parts' settings have for them.
    """
    batches = [_checked(part, part.output(output), manner, places or {}) for part in parts]
    return [_in_place(batch, manner) for batch in batches]


def _in_place(batch: CheckedBatch, manner: Manner) -> CheckedBatch:
    """A batch whose place may be taken: by going on, or instead of what lies there."""
    check_free(batch.output)
    if batch.recorded is not None:
        return batch
    if not manner.overwrite:
        check_replaceable(batch.output)
    other = other_batch(batch.output, batch.manifest)
    if other is None:
        return batch
    if not (manner.overwrite or manner.scratch):
        check_kept(batch.output, batch.manifest)
    return dataclasses.replace(batch, replaced=episodes_of(other))


def check_kept(output: Path, manifest: Mapping[str, Any]) -> None:
    """Raise ResultsError where another finished batch lies in a file that the user named."""
    other = other_batch(output, manifest)
    if other is not None:
        different = next(differences(other, manifest, apart=UNESSENTIAL))
        raise ResultsError(
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


def _checked(part: Part, output: Path, manner: Manner, places: Mapping[str, Path]) -> CheckedBatch:
    """Check one batch."""
    _check_output(output)
    recorded = _recorded(output, manner)
    source = f"run: {part.name}" if part.name else "run"
    settings = {**part.defaults, **recorded_settings(recorded), **part.settings}
    places = {**places, **_present(recorded, output, part.settings)}
    prepared = prepare(plan_from(settings, source, places))
    prepared = prepared.without(recorded_outputs(recorded))
    now = manifest(prepared)
    different = [] if recorded is None else list(differences(recorded, now))
    if different:
        raise ResultsError(f"results {str(output)!r} are of another batch: {'; '.join(different)}")
    return CheckedBatch(part.name, output, prepared, now, recorded)


def _check_output(output: Path) -> None:
    """Refuse a path that cannot become a results file."""
    if not output.parent.is_dir():
        raise InputError(f"output {str(output)!r}: no such folder {str(output.parent)!r}")
    if output.suffix != ".csv":
        raise InputError(f"output {str(output)!r}: expected a name that ends in .csv")
    if output.is_dir() or output.with_suffix("").is_file():
        raise InputError(f"output {str(output)!r}: its place is taken")


def _recorded(output: Path, manner: Manner) -> dict[str, Any] | None:
    """The manifest of the batch to continue, None for a new one.

    With ``resume`` there may be no results yet, so that the same command starts and continues.
    """
    if not (manner.resume or manner.retry_errors):
        return None
    rows = output.is_file() and output.stat().st_size > 0
    if manner.resume and not rows and not output.with_suffix(".json").exists():
        return None  # a kill may leave an empty file
    return read_manifest(output)


def _present(
    recorded: Mapping[str, Any] | None, output: Path, given: Mapping[str, Any]
) -> dict[str, Path]:
    """The present paths of the files of a batch to continue, but for those that are named again."""
    try:
        plan = BatchPlan.model_validate((recorded or {})["plan"])
        agents = cast_of(given.get("agents", ())).values()
    except (KeyError, ValueError):  # no batch, none to go on with, or agents that are refused later
        return {}
    scenario = plan.scenario
    named = {str(scenario.net)} if "net" in given else set()
    named |= {str(scenario.routes)} if "routes" in given else set()
    named |= set(map(str, scenario.additional)) if "additional" in given else set()
    named |= {str(given.get("params", {}).get(key)) for key in plan.params}
    named |= {str(policy_file(name)) for name in agents}
    record = Record(plan, {}, None, recorded or {}, output)
    return present_paths(record, input_files(plan).keys() - named)


def recorded_outputs(recorded: Mapping[str, Any] | None) -> list[str]:
    """The files that the ego of a recorded batch wrote."""
    return [str(name) for name in (recorded or {}).get(OUTPUTS) or ()]


def recorded_settings(recorded: Mapping[str, Any] | None) -> dict[str, Any]:
    """The settings of a recorded plan; settings that are not given again are kept."""
    if recorded is None:
        return {}
    try:
        plan = dict(recorded["plan"])
        flat = {"routes": "none"} | {k: v for k, v in plan.pop("scenario").items() if v is not None}
        return flat | {k: v for k, v in plan.items() if v is not None}
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ResultsError("the manifest holds no plan to go on with") from error
