"""A merge of large parts: lines are copied as they are, and counted by columns.

Only where that gives the same bytes as row by row: the parts have the columns of this version, and
a line is plain text. Rows with files, and other lines, are written one by one.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cavsumo.batch.merge_parts import outcome_of, trace_of
from cavsumo.batch.tally import AT_ONCE, COUNTED, Tally
from cavsumo.errors import ResultsError
from cavsumo.results.columnar import CHECKED, Doubtful, LineBlock, block, blocks, check_table
from cavsumo.results.columns import COLUMNS
from cavsumo.results.writing import Recorder

# Anything but printable ASCII without quotes, and numbers that begin with a needless zero.
UNPLAIN = re.compile(rb"[^ !#-~\n]|^0[0-9]", re.MULTILINE)


def owners(parts: Sequence[Path], total: int) -> NDArray[np.intp] | None:
    """The part that has each run; None where the parts are no whole, or must be read row by row."""
    try:
        runs = [np.concatenate([*_runs(part), np.empty(0, np.int64)]) for part in parts]
    except (Doubtful, ResultsError):
        return None
    together = np.concatenate(runs)
    ascending = all((np.diff(own) > 0).all() for own in runs)
    if not ascending or len(together) != total or (np.sort(together) != np.arange(total)).any():
        return None
    found = np.empty(total, np.intp)
    for i, own in enumerate(runs):
        found[own] = i
    return found


def _runs(part: Path) -> Iterator[NDArray[np.int64]]:
    """The numbers of the runs of a part whose rows and traces have been checked."""
    if part.with_suffix("").is_symlink():
        raise Doubtful
    for lines in blocks(part):
        if list(lines.columns) != list(COLUMNS):
            raise Doubtful
        table = lines.table((*CHECKED, "trace"), ("run",))
        check_table(table)
        for row in table.loc[table["trace"] != "", ["run", "trace"]].itertuples():
            trace_of(part, {"run": str(row.run), "trace": row.trace})
        yield table["run"].to_numpy()


def copy(parts: Sequence[Path], owners: NDArray[np.intp], recorder: Recorder, tally: Tally) -> None:
    """Write the rows of all parts in the order of their runs, and count them."""
    streams = [_lines(part) for part in parts]
    logged = [_logged(part) for part in parts]
    for start in range(0, len(owners), AT_ONCE):
        own = owners[start : start + AT_ONCE].tolist()
        lines = [next(streams[part]) for part in own]
        found = block(b"".join(lines), list(COLUMNS))
        _count(found, lines, tally)
        apart = set(np.flatnonzero(found.table(["trace"])["trace"] != "").tolist())
        apart |= {i for i, part in enumerate(own) if start + i in logged[part]}
        if UNPLAIN.search(found.data):
            apart |= {i for i, line in enumerate(lines) if UNPLAIN.search(line)}
        _write(lines, start, sorted(apart), [parts[i] for i in own], recorder)


def _write(
    lines: Sequence[bytes],
    first: int,
    apart: Sequence[int],
    places: Sequence[Path],
    recorder: Recorder,
) -> None:
    """Write lines of consecutive runs; those apart by their rows, with their files."""
    begin = 0
    for i in (*apart, len(lines)):
        if begin < i:
            recorder.copy(b"".join(lines[begin:i]), first + i - 1)
        if i < len(lines):
            recorder.write(outcome_of(places[i], first + i, _row(lines[i])))
        begin = i + 1


def _count(found: LineBlock, lines: Sequence[bytes], tally: Tally) -> None:
    """Count rows by their columns."""
    table = found.table(COUNTED)
    columns = {name: table[name].tolist() for name in COUNTED}
    tally.add_all(columns, lambda i: _row(lines[i]))


def _row(line: bytes) -> dict[str, Any]:
    """A line as a row."""
    cells = next(csv.reader([line.decode("utf-8")]))
    row: dict[str, Any] = dict(zip(COLUMNS, cells, strict=True))
    return row | {"run": int(row["run"])}


def _lines(part: Path) -> Iterator[bytes]:
    """The lines of a part below its header."""
    with part.open("rb") as stream:
        yield from islice(stream, 1, None)


def _logged(part: Path) -> set[int]:
    """The runs of a part in which the ego printed something."""
    names = part.with_suffix("").glob("run*.ego.log")
    numbers = (file.name.removeprefix("run").removesuffix(".ego.log") for file in names)
    return {int(number) for number in numbers if number.isdecimal()}
