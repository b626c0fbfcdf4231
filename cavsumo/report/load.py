"""The rows of one or several results files as one table, with columns from their manifests."""

from __future__ import annotations

import math
import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy
import pandas
from pandas.api.types import union_categoricals

from cavsumo.batch.stopping import looks_at_rows
from cavsumo.errors import ResultsError, UnknownName
from cavsumo.model.scenario import BatchPlan
from cavsumo.results.columnar import Doubtful, blocks, constant
from cavsumo.results.columns import COLUMNS
from cavsumo.results.reading import whole_lines
from cavsumo.results.recorded_plan import recorded_plan

OUTCOMES = ("violated", "held", "unfair", "not_triggered", "invalid", "error")
# The columns that a report needs; others are read only on request.
NUMBERS = (
    "trigger_time_s",
    "violation_time_s",
    "time_s",
    "impact_speed_mps",
    "wall_s",
    "avoidable",
    "avoidable_ideal",
    "grade",
    "meets_m",
    "tester_speed_mps",
    "arrived",
    "lost_s",
    "stood_s",
)
WORDS = (
    "agent",
    "case",
    "outcome",
    "breach",
    "blame",
    "assertion",
    "verdicts",
    "tester",
    "from_side",
    "reference",
    "frozen",
    "trace",
    "error",
)
WHOLE = ("run", "seed")
NEEDED = (*WHOLE, *WORDS, *NUMBERS)
ADDED = ("file", "net")  # values for grouping besides the columns


@dataclass(frozen=True)
class Batch:
    """One results file.

    Attributes:
        csv_file, plan, manifest: its file, its plan, its manifest.
        sequential: the number of episodes may depend on their results.
    """

    csv_file: Path
    plan: BatchPlan
    manifest: Mapping[str, Any]
    sequential: bool

    @property
    def unfinished(self) -> bool:
        """Whether episodes are missing without a stopping rule."""
        return self.manifest.get("status") not in ("finished", "stopped")


@dataclass(frozen=True)
class Evidence:
    """All rows as a table: one row per episode, in the order of the files and of the runs.

    Attributes:
        batches: the sources of the rows.
        rows: the columns ``NEEDED``, those of ``ADDED``, the one asked for and ``batch``, the index
            of the batch. Numbers are floats, NaN for none; words are categories of text, empty for
            none.
    """

    batches: tuple[Batch, ...]
    rows: pandas.DataFrame


def check_column(by: str) -> None:
    """Raise UnknownName unless rows can be grouped by a column."""
    if by not in (*COLUMNS, *ADDED):
        raise UnknownName("column", by, (*COLUMNS, *ADDED), "--by")


def load(files: Sequence[Path], by: str = "agent") -> Evidence:
    """Read results; raises ResultsError in one sentence for missing or damaged files."""
    check_column(by)
    _check_apart(files)
    batches = [_batch(file) for file in files]
    tables = [_rows(batch, i, by) for i, batch in enumerate(batches)]
    return Evidence(tuple(batches), together(tables))


def _check_apart(files: Sequence[Path]) -> None:
    """Refuse a file that is named twice."""
    seen: set[Path] = set()
    for file in files:
        if file.resolve() in seen:
            raise ResultsError(f"results {str(file)!r}: named twice")
        seen.add(file.resolve())


def _batch(csv_file: Path) -> Batch:
    """A results file with its manifest."""
    plan, manifest = recorded_plan(csv_file)
    return Batch(csv_file, plan, manifest, looks_at_rows(plan))


def _rows(batch: Batch, index: int, by: str) -> pandas.DataFrame:
    """The rows of one file."""
    file = batch.csv_file
    columns = list(dict.fromkeys((*NEEDED, *([by] if by in COLUMNS else []))))
    try:
        tables = [_checked(block.table(columns, WHOLE), file) for block in blocks(file)]
    except (Doubtful, ResultsError):  # read row by row it is accepted, or the first error is told
        tables = [_checked(_read(file, columns), file)]
    table = together(tables) if tables else _checked(_read(file, columns), file)
    length, places = len(table), {"file": str(file), "net": batch.plan.scenario.name}
    return table.assign(batch=index, **{k: constant(v, length) for k, v in places.items()})


def _read(file: Path, columns: Sequence[str]) -> pandas.DataFrame:
    """The columns of a file, as text, row by row."""
    pick = operator.itemgetter(*columns)
    cells = [pick(row) for _, row in whole_lines(file) if row is not None]
    return pandas.DataFrame(cells, columns=list(columns), dtype="object")


def _checked(table: pandas.DataFrame, file: Path) -> pandas.DataFrame:
    """The same with numbers as numbers, and words as categories."""
    for column in (*WHOLE, *NUMBERS):
        table[column] = _numbers(table, column, file)
    _check_outcomes(table, file)
    words = table.columns.difference([*WHOLE, *NUMBERS])
    return table.astype(dict.fromkeys(words, "category"))


def together(tables: Sequence[pandas.DataFrame]) -> pandas.DataFrame:
    """Tables with the same columns below each other; categories stay categories."""
    if len(tables) == 1:
        return tables[0]
    columns: dict[str, Any] = {}
    for name, first in tables[0].items():
        parts = [table[name] for table in tables]
        if isinstance(first.dtype, pandas.CategoricalDtype):
            columns[str(name)] = union_categoricals(parts)
        else:
            columns[str(name)] = pandas.concat(parts, ignore_index=True)
    return pandas.DataFrame(columns, copy=False)


def _numbers(table: pandas.DataFrame, column: str, file: Path) -> pandas.Series:
    """A column as numbers, whole ones for the seeds."""
    if column in WHOLE and table[column].dtype == "int64":
        return table[column]
    if isinstance(table[column].dtype, pandas.CategoricalDtype):
        return _numbers_of_categories(table[column])
    numbers = pandas.to_numeric(table[column].where(table[column] != ""), errors="coerce")
    wrong = (numbers.isna() & (table[column] != "")) | numbers.isin((math.inf, -math.inf))
    if column in WHOLE:
        wrong |= numbers.isna() | (numbers % 1 != 0)
    _refuse(table, wrong, column, "a whole number" if column in WHOLE else "a number", file)
    return numbers.astype("int64" if column in WHOLE else "float64")


def _numbers_of_categories(texts: pandas.Series) -> pandas.Series:
    """The same of a column that has few texts; raises Doubtful if any is no number."""
    found = texts.cat.categories.to_numpy(object)
    numbers = pandas.to_numeric(pandas.Series(found[found != ""], dtype="object"), errors="coerce")
    if not numpy.isfinite(numbers).all():
        raise Doubtful
    values = numpy.full(len(found), numpy.nan)
    values[found != ""] = numbers
    return pandas.Series(values[texts.cat.codes], index=texts.index)


def _check_outcomes(table: pandas.DataFrame, file: Path) -> None:
    """Check that outcomes are known, and that tests have a trigger time."""
    _refuse(
        table, ~table["outcome"].isin(OUTCOMES), "outcome", "one of " + ", ".join(OUTCOMES), file
    )
    tests = table["outcome"].isin(("held", "violated"))
    for column, whose in (
        ("trigger_time_s", tests),
        ("violation_time_s", table["outcome"] == "violated"),
        ("time_s", table["outcome"] != "error"),
    ):
        _refuse(table, whose & table[column].isna(), column, "a number", file)


def _refuse(
    table: pandas.DataFrame, wrong: pandas.Series, column: str, expected: str, file: Path
) -> None:
    """Raise ResultsError for the first wrong cell."""
    if wrong.any():
        row = table[wrong].iloc[0]
        cell = "" if row[column] != row[column] else str(row[column])
        raise ResultsError(
            f"results {str(file)!r}: run {row['run']}: {column} is {cell!r}, expected {expected}"
        )
