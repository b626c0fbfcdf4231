"""The columns of a large results file as tables, block by block, in compiled code.

Rows are read one by one where a few are enough (``reading.whole_lines``). Here every line is
checked for its number of cells without making its cells, and only the columns asked for are made.
Anything unusual is ``Doubtful``: the caller then reads the file row by row, which either accepts
it or finds the sentence that says what is wrong.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas
from numpy.typing import NDArray

from cavsumo.results.columns import COLUMNS
from cavsumo.results.reading import FIRST
from cavsumo.results.schema import NEEDED, NUMBER, NUMBERS, OUTCOMES, WHOLE, WHOLE_NUMBER

BLOCK = 4 << 20  # bytes read at a time
NEWLINE, COMMA, QUOTE = b"\n"[0], b","[0], b'"'[0]
CHECKED = (*WHOLE, "outcome", *NUMBERS)
LONGEST_RUN = 9  # digits of the number of a run, as ``whole_lines`` takes it


class Doubtful(Exception):
    """A file that must be read row by row."""


@dataclass(frozen=True)
class LineBlock:
    """Complete lines of a results file, each a row.

    Attributes:
        data: the lines.
        columns: the columns of the file.
        ends: the place of the end of each line in the data.
    """

    data: bytes
    columns: Sequence[str]
    ends: NDArray[np.int64]

    def table(self, names: Sequence[str], whole: Sequence[str] = ()) -> pandas.DataFrame:
        """Some columns: whole numbers as integers, all others as categories of text.

        Columns that were added since the file was written are empty. Raises Doubtful.
        """
        there = [name for name in names if name in self.columns]
        types = {name: "int64" if name in whole else "object" for name in there}
        try:
            table = pandas.read_csv(
                io.BytesIO(self.data),
                header=None,
                names=list(self.columns),
                usecols=there,
                dtype=types,
                keep_default_na=False,
                skip_blank_lines=False,
                lineterminator="\n",
                low_memory=False,
            )
        except (ValueError, OverflowError) as error:  # no whole number, no UTF-8
            raise Doubtful from error
        if len(table) != len(self.ends):
            raise Doubtful
        # pandas itself would make numbers of categories that look like some
        texts = {name: table[name].astype("category") for name in there if name not in whole}
        added = {name: constant("", len(table)) for name in set(names).difference(there)}
        return table.assign(**texts, **added)[list(names)]


def constant(value: str, length: int) -> pandas.Categorical:
    """A column with one value in every row."""
    return pandas.Categorical.from_codes(np.zeros(length, np.int8), [value])


def check_table(table: pandas.DataFrame) -> None:
    """Raise Doubtful unless ``schema.check_row`` takes every row.

    Args:
        table: with the columns ``CHECKED``, all but the run as categories of text.
    """
    for names, shape in ((WHOLE, WHOLE_NUMBER), (NUMBERS, NUMBER)):
        for name in set(names) - {"run"}:
            texts = table[name].cat.categories
            if not all(shape.fullmatch(text) for text in texts if text or name in WHOLE):
                raise Doubtful
    if not set(table["outcome"].cat.categories) <= set(OUTCOMES):
        raise Doubtful
    for name, outcomes in NEEDED.items():
        if ((table[name] == "") & table["outcome"].isin(outcomes)).any():
            raise Doubtful


def blocks(csv_file: Path) -> Iterator[LineBlock]:
    """The complete lines of a results file; a torn last line is left out. Raises Doubtful."""
    try:
        with csv_file.open("rb") as stream:
            columns = _header(stream.readline())
            rest = b""
            while data := stream.read(BLOCK):
                end = data.rfind(b"\n") + 1
                if end:
                    yield block(rest + data[:end], columns)
                rest = data[end:] if end else rest + data
    except OSError as error:
        raise Doubtful from error


def _header(line: bytes) -> list[str]:
    """The columns that a header names."""
    columns = line.decode("utf-8", errors="replace").removesuffix("\n").split(",")
    known = [column for column in COLUMNS if column in FIRST.union(columns)]
    if columns != known or not line.endswith(b"\n"):
        raise Doubtful
    return columns


def block(data: bytes, columns: Sequence[str]) -> LineBlock:
    """Lines that all have one cell a column, and begin with the number of a run."""
    if b"\r" in data or b"\0" in data:
        raise Doubtful
    letters = np.frombuffer(data, np.uint8)
    ends, commas = np.flatnonzero(letters == NEWLINE), np.flatnonzero(letters == COMMA)
    before = np.searchsorted(commas, ends)
    counts, firsts = np.diff(before, prepend=0), np.concatenate(([0], before[:-1]))
    starts = np.concatenate(([0], ends[:-1] + 1))
    plain = np.ones(len(ends), bool)
    if b'"' in data:
        quotes = np.flatnonzero(letters == QUOTE)
        plain[np.unique(np.searchsorted(ends, quotes))] = False
        for i in np.flatnonzero(~plain):
            _check_quoted(data[starts[i] : ends[i] + 1], len(columns))
    if (counts[plain] != len(columns) - 1).any() or (counts == 0).any():
        raise Doubtful
    lengths = commas[firsts] - starts
    edges = letters[starts], letters[starts + lengths - 1]
    digits = [(edge >= b"0"[0]) & (edge <= b"9"[0]) for edge in edges]
    if not (all(d.all() for d in digits) and (lengths > 0).all() and lengths.max() <= LONGEST_RUN):
        raise Doubtful
    return LineBlock(data, columns, ends)


def _check_quoted(line: bytes, cells: int) -> None:
    """Check a line in which some cells are quoted."""
    try:
        found = next(csv.reader([line.decode("utf-8")]))
    except (UnicodeDecodeError, csv.Error, StopIteration) as error:
        raise Doubtful from error
    if len(found) != cells or any("\n" in cell for cell in found):
        raise Doubtful
