"""The rows of a large batch that is to be continued: checked and counted by columns.

Only what is plainly as this version wrote it is read so; anything else is read row by row, which
either takes it or finds the sentence that says what is wrong.
"""

from __future__ import annotations

import csv
import hashlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from cavsumo.batch.tally import COUNTED, Row, Tally
from cavsumo.results.columnar import CHECKED, Doubtful, LineBlock, blocks, check_table
from cavsumo.results.columns import COLUMNS
from cavsumo.results.reading import HEADER
from cavsumo.results.writing import Written

NEEDLESS_ZERO = re.compile(rb"\n0[0-9]")  # of the number of a run
READ = tuple(dict.fromkeys((*CHECKED, *COUNTED, "trace")))  # columns


@dataclass(frozen=True)
class TakenUp:
    """The rows of a batch so far.

    Attributes:
        written: what the recorder has to know of them.
        tally: their counts.
        todo: the numbers of the episodes behind them, in order.
    """

    written: Written
    tally: Tally
    todo: Iterator[int]


def taken_up(csv_file: Path, todo: Iterator[int]) -> TakenUp | None:
    """The rows of a results file; None where it must be read row by row.

    Args:
        todo: the numbers of all episodes of the batch in order, of which the rows are the first.
    """
    tally, total = Tally(), hashlib.sha256(HEADER.encode("utf-8"))
    size, last, traces = len(HEADER), -1, 0
    try:
        for lines in blocks(csv_file):
            last, kept = _count(lines, todo, tally)
            total.update(lines.data)
            size, traces = size + len(lines.data), traces + kept
    except (Doubtful, UnicodeDecodeError):
        return None
    return TakenUp(Written(size, total, last, traces), tally, todo)


def _count(lines: LineBlock, todo: Iterator[int], tally: Tally) -> tuple[int, int]:
    """Check and count some rows; the number of the last, and how many have a trace."""
    lines.data.decode("utf-8")
    if list(lines.columns) != list(COLUMNS) or NEEDLESS_ZERO.search(b"\n" + lines.data):
        raise Doubtful
    table = lines.table(READ, ("run",))
    check_table(table)
    runs = table["run"].to_numpy()
    if not np.array_equal(runs, np.fromiter(islice(todo, len(runs)), np.int64)):
        raise Doubtful

    def row(place: int) -> Row:
        begin = lines.ends[place - 1] + 1 if place else 0
        cells = next(csv.reader([lines.data[begin : lines.ends[place] + 1].decode("utf-8")]))
        return dict(zip(COLUMNS, cells, strict=True))

    tally.add_all({name: table[name].tolist() for name in COUNTED}, row)
    return int(runs[-1]), int((table["trace"] != "").sum())
