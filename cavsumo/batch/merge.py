"""Merging shards into the results file that a single run would have written."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from cavsumo.batch.ended import Ended
from cavsumo.batch.preflight import check_kept
from cavsumo.batch.prepared import OUTPUTS
from cavsumo.batch.tally import Tally
from cavsumo.errors import InputError, ResultsError
from cavsumo.model.documents import read_text
from cavsumo.results.present import input_files, present_paths
from cavsumo.results.provenance import differences
from cavsumo.results.reading import check_apart, check_cells, ego_log_name, inside, whole_lines
from cavsumo.results.recorded_plan import recorded_plan
from cavsumo.results.rows import Outcome
from cavsumo.results.trace_file import packed, read_packed, unpacked
from cavsumo.results.writing import Recorder

SHOWN = 5  # missing episodes that are named
APART = frozenset({"shard", "deadline_s", "budget_s"})  # settings in which parts may differ
Numbered = tuple[int, int, dict[str, str]]  # run, which part, row


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
    _check_whole(parts, whole)
    if not overwrite:
        check_kept(output, whole)
    inputs = _inputs(parts, warn)
    tally = Tally()
    with Recorder(output) as recorder:
        recorder.begin(whole, overwrite=overwrite)
        recorder.keep(inputs)
        for run, part, row in _in_order(parts):
            files = _trace_of(parts[part], row), _log_of(parts[part], run)
            tally.add(recorder.write(Outcome(row | {"run": run}, *files)))
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


def _check_whole(parts: Sequence[Path], whole: dict[str, Any]) -> None:
    """Every episode must be there, once."""
    total = whole["plan"]["runs"] * len(whole["plan"]["agents"])
    missing: list[int] = []
    expected = owner = 0
    for run, part, row in _in_order(parts):
        if run < expected:
            there = " and in ".join(repr(str(parts[i])) for i in sorted({owner, part}))
            raise ResultsError(f"run {run} is there twice, in {there}")
        if run >= total:
            raise ResultsError(f"{str(parts[part])!r}: run {run} of a batch of {total} episodes")
        missing += range(expected, min(run, expected + SHOWN))
        _trace_of(parts[part], row)
        _log_of(parts[part], run)
        expected, owner = run + 1, part
    missing += range(expected, min(total, expected + SHOWN))
    if missing:
        some = ", ".join(map(str, missing[:SHOWN]))
        more = ", ..." if len(missing) > SHOWN else ""
        raise ResultsError(f"the parts have gaps: no run {some}{more} of {total} episodes")


def _in_order(parts: Sequence[Path]) -> Iterator[Numbered]:
    """The rows of all parts by their numbers."""
    return heapq.merge(*(_numbered(part, i) for i, part in enumerate(parts)), key=lambda n: n[:2])


def _numbered(part: Path, index: int) -> Iterator[Numbered]:
    """The rows of one part, which must ascend."""
    last = -1
    for _, row in whole_lines(part):
        if row is not None:
            run = int(row["run"])
            check_cells(part, row)
            if run <= last:
                raise ResultsError(f"results {str(part)!r}: run {run} stands behind run {last}")
            last = run
            yield run, index, row


def _trace_of(part: Path, row: dict[str, str]) -> bytes:
    """The bytes of a row's trace file, empty for none; one that is plain text is compressed."""
    if not row["trace"]:
        return b""
    file, what = inside(part, row["trace"]), f"results {str(part)!r}: trace of run {row['run']}"
    return packed(unpacked(read_packed(file, what), f"{what} {str(file)!r}"))


def _log_of(part: Path, run: int) -> str:
    """The ego's output in an episode, empty for none."""
    file = inside(part, ego_log_name(part, run))
    what = f"results {str(part)!r}: ego's output in run {run}"
    return read_text(file, what, ResultsError) if file.exists() else ""
