"""The parts of a merge, read row by row: rows in the order of their runs, with their files."""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from cavsumo.errors import ResultsError
from cavsumo.model.documents import read_text
from cavsumo.results.reading import check_cells, ego_log_name, inside, whole_lines
from cavsumo.results.rows import Outcome
from cavsumo.results.trace_file import packed, read_packed, unpacked

SHOWN = 5  # missing episodes that are named
Numbered = tuple[int, int, dict[str, str]]  # run, which part, row


def check_rows(parts: Sequence[Path], total: int) -> None:
    """Every episode must be there, once, with its files; raises ResultsError."""
    missing: list[int] = []
    expected = owner = 0
    for run, part, row in in_order(parts):
        if run < expected:
            there = " and in ".join(repr(str(parts[i])) for i in sorted({owner, part}))
            raise ResultsError(f"run {run} is there twice, in {there}")
        if run >= total:
            raise ResultsError(f"{str(parts[part])!r}: run {run} of a batch of {total} episodes")
        missing += range(expected, min(run, expected + SHOWN))
        outcome_of(parts[part], run, row)
        expected, owner = run + 1, part
    missing += range(expected, min(total, expected + SHOWN))
    if missing:
        some = ", ".join(map(str, missing[:SHOWN]))
        more = ", ..." if len(missing) > SHOWN else ""
        raise ResultsError(f"the parts have gaps: no run {some}{more} of {total} episodes")


def in_order(parts: Sequence[Path]) -> Iterator[Numbered]:
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


def outcome_of(part: Path, run: int, row: Mapping[str, str]) -> Outcome:
    """A row with its trace and the ego's output."""
    return Outcome(dict(row) | {"run": run}, trace_of(part, row), _log_of(part, run))


def trace_of(part: Path, row: Mapping[str, str]) -> bytes:
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
