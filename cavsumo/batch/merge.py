"""Merging shards into the results file that a single run would have written."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cavsumo.batch.ended import Ended
from cavsumo.batch.merge_parts import check_rows, in_order, outcome_of
from cavsumo.batch.preflight import check_kept
from cavsumo.batch.prepared import OUTPUTS
from cavsumo.batch.tally import Tally
from cavsumo.errors import InputError, ResultsError
from cavsumo.results.present import input_files, present_paths
from cavsumo.results.provenance import differences
from cavsumo.results.reading import check_apart
from cavsumo.results.recorded_plan import recorded_plan
from cavsumo.results.writing import Recorder

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

LARGE = 8 << 20  # bytes from which parts are worth the import of pandas, which takes 0.4 s
APART = frozenset({"shard", "deadline_s", "budget_s"})  # settings in which parts may differ


def merged(
    parts: Sequence[Path],
    output: Path,
    *,
    overwrite: bool,
    warn: Callable[[str], None] = lambda said: None,
) -> Ended:
    """Check that the parts are complete, then write the whole; raises ResultsError if not.

    ``warn`` is told of inputs that are not found, so that the whole is without them.
    """
    check_apart(output, parts)
    whole = _whole_manifest(parts)
    total = whole["plan"]["runs"] * len(whole["plan"]["agents"])
    owners = _owners(parts, total)
    if owners is None:
        check_rows(parts, total)
    if not overwrite:
        check_kept(output, whole)
    inputs = _inputs(parts, warn)
    tally = Tally()
    with Recorder(output) as recorder:
        recorder.begin(whole, overwrite=overwrite)
        recorder.keep(inputs)
        if owners is None:
            for run, part, row in in_order(parts):
                tally.add(recorder.write(outcome_of(parts[part], run, row)))
        else:
            from cavsumo.batch.merge_large import copy

            copy(parts, owners, recorder, tally)
        facts = tally.facts()
        recorder.finish("finished", facts)
    return Ended("", output, tally, recorder.traces, str(whole["plan"].get("reference", "none")))


def _whole_manifest(parts: Sequence[Path]) -> dict[str, Any]:
    """The manifest of the whole; the parts must be of one batch."""
    first: dict[str, Any] | None = None
    for part in parts:
        _, manifest = recorded_plan(part)
        if first is None:
            first = manifest
        different = list(differences(first, manifest, apart=APART))
        if different:
            raise ResultsError(
                f"{str(part)!r} and {str(parts[0])!r} are of different batches: "
                + "; ".join(different)
            )
    assert first is not None
    kept = {"command", "call", "ego_route", "junction", "sha256", "versions", "sumo_options"} | {
        OUTPUTS
    }
    plan = dict(first["plan"]) | {"shard": None}
    return {key: first[key] for key in first if key in kept} | {
        "plan": plan,
        "merged_from": [str(part) for part in parts],
    }


def _inputs(parts: Sequence[Path], warn: Callable[[str], None]) -> dict[str, Path]:
    """The inputs of the batch by their checksums, each from the first part that has it."""
    plan, manifest = recorded_plan(parts[0])
    sums = dict(manifest.get("sha256") or {})
    found: dict[str, Path] = {}
    for name, was in input_files(plan).items():
        problem = None
        for part in parts if name in sums else ():
            try:
                places = present_paths(plan, manifest, part, [name])
            except InputError as error:
                problem = problem or error
            else:
                found[sums[name]] = places.get(name, was)
                break
        if name in sums and sums[name] not in found:
            warn(f"{problem}; the whole is without it")
    return found


def _owners(parts: Sequence[Path], total: int) -> NDArray[np.intp] | None:
    """The part of each run where large parts are a whole; None to read them row by row."""
    if sum(part.stat().st_size for part in parts if part.is_file()) < LARGE:
        return None
    from cavsumo.batch.merge_large import owners  # which imports pandas

    return owners(parts, total)
