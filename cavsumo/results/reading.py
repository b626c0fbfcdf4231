"""Results on disk, read: manifest and rows, with one sentence when they are damaged."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path, PureWindowsPath
from typing import TYPE_CHECKING, Any

from cavsumo.errors import ResultsError, shown
from cavsumo.model.documents import json_of, read_text
from cavsumo.results.columns import COLUMNS
from cavsumo.results.schema import check_manifest, check_row

if TYPE_CHECKING:
    import pandas

FORMAT = "cavsumo-results-1"
STARTING = "starting"  # the rows beside a manifest with this status belong to an earlier batch
COMPLETE = ("finished", "stopped", STARTING)  # the statuses of complete batches
HEADER = ",".join(COLUMNS) + "\n"
FIRST = frozenset(name for name, column in COLUMNS.items() if column.since == "0.1")


def ego_log_name(csv_file: Path, run: int) -> str:
    """The path of the ego's output in an episode, relative to the results file."""
    return f"{csv_file.stem}/run{run:06d}.ego.log"


def inside(csv_file: Path, name: str) -> Path:
    """The file of that name in the folder of a results file, links followed.

    Raises ResultsError for a name that leads out of the folder: one that is absolute, one with
    "..", one that follows a link.
    """
    folder, parts = csv_file.parent, PureWindowsPath(name)  # which knows both separators
    try:
        out = bool(parts.anchor or ".." in parts.parts)
        out = out or not (folder / name).resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError) as error:  # a null character, links in a circle
        raise ResultsError(f"results {str(csv_file)!r}: {name!r} is no name of a file") from error
    if out:
        raise ResultsError(f"results {str(csv_file)!r}: {name!r} leads out of their folder")
    return folder / name


def read_manifest(csv_file: Path) -> dict[str, Any]:
    """The manifest that belongs to a results file."""
    file = csv_file.with_suffix(".json")
    text = read_text(file, "manifest", ResultsError)
    try:
        data = json_of(text)
    except ValueError as error:
        raise ResultsError(f"manifest {str(file)!r}: cannot be read: {error}") from error
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise ResultsError(f"manifest {str(file)!r}: is not of the format {FORMAT}")
    try:
        check_manifest(data)
    except ValueError as error:
        raise ResultsError(f"manifest {str(file)!r}: {error}") from error
    return data


def check_replaceable(csv_file: Path) -> None:
    """Raise ResultsError unless a new batch may replace the existing files."""
    name, file = f"results {str(csv_file)!r}", csv_file.with_suffix(".json")
    rows = csv_file.is_file() and csv_file.stat().st_size > 0
    if not rows and not file.exists():
        return
    try:
        status = read_manifest(csv_file)["status"]
    except (ResultsError, KeyError) as error:
        there = csv_file.name if rows else file.name
        raise ResultsError(
            f"{name}: {there!r} is there and not a batch of cavsumo; --overwrite replaces it"
        ) from error
    if rows and status not in COMPLETE:
        raise ResultsError(
            f"{name}: an unfinished batch ({status}); --resume goes on, --overwrite starts again"
        )


def check_apart(output: Path, parts: Sequence[Path]) -> None:
    """Raise ResultsError where results would be written over one of the parts they are made of."""
    if output.resolve() in [part.resolve() for part in parts]:
        raise ResultsError(f"output {str(output)!r}: is one of the parts")


def read_rows(csv_file: Path) -> list[dict[str, str]]:
    """The rows of a results file, as text."""
    return list(rows_of(csv_file))


def rows_of(csv_file: Path, *, filled: bool = True) -> Iterator[dict[str, str]]:
    """The rows of a results file one by one, as text; the columns must be ours.

    ``filled``: cells of columns that were added since the file was written are empty, not missing.
    """
    try:
        with csv_file.open(encoding="utf-8", newline="") as stream:
            reader = csv.DictReader(stream, restval="")
            missing = [column for column in COLUMNS if column not in (reader.fieldnames or ())]
            for column in missing:
                if column in FIRST:
                    raise ResultsError(f"results {str(csv_file)!r}: no column {column!r}")
            added = dict.fromkeys(missing, "") if filled else {}
            yield from (row | added for row in reader)
    except OSError as error:
        raise ResultsError(
            f"results {str(csv_file)!r}: cannot be read: {error.strerror}"
        ) from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise ResultsError(
            f"results {str(csv_file)!r}: line {reader.line_num + 1} is damaged"
        ) from error


def whole_lines(csv_file: Path) -> Iterator[tuple[bytes, dict[str, str] | None]]:
    """The complete lines of a results file with their rows, None for the header.

    A torn last line is left out; any other damage raises ResultsError with the line's number.
    Cells of columns that were added since the file was written are empty.
    """
    columns: list[str] = []
    name = f"results {str(csv_file)!r}"
    try:
        stream = csv_file.open("rb")
    except OSError as error:
        raise ResultsError(f"{name}: cannot be read: {error.strerror}") from error
    with stream:
        for number, line in enumerate(stream, 1):
            if not line.endswith(b"\n"):
                return
            if number > 1:
                yield line, _parsed(line, columns, f"{name}: line {number}")
                continue
            columns = line.decode("utf-8", errors="replace").removesuffix("\n").split(",")
            if columns != [column for column in COLUMNS if column in FIRST.union(columns)]:
                raise ResultsError(f"{name}: line 1 does not hold the columns of cavsumo")
            yield line, None


def _parsed(line: bytes, columns: Sequence[str], place: str) -> dict[str, str]:
    """A line as a row."""
    try:
        cells = next(csv.reader([line.decode("utf-8")]))
    except (UnicodeDecodeError, csv.Error, StopIteration) as error:
        raise ResultsError(f"{place} is damaged") from error
    if len(cells) != len(columns):
        raise ResultsError(f"{place} has {len(cells)} cells, expected {len(columns)}")
    row = dict.fromkeys(COLUMNS, "") | dict(zip(columns, cells, strict=True))
    if not re.fullmatch(r"[0-9]{1,9}", row["run"]):
        raise ResultsError(f"{place} begins with {shown(row['run'])}, expected the number of a run")
    return row


def check_cells(csv_file: Path, row: Mapping[str, str]) -> None:
    """Raise ResultsError unless what is computed from a row of a results file can be."""
    try:
        check_row(row)
    except ValueError as error:
        place = f"results {str(csv_file)!r}: run {shown(row.get('run') or '')}"
        raise ResultsError(f"{place}: {error}") from error


def read_results(csv_file: Path) -> pandas.DataFrame:
    """The rows as a pandas table: numbers as numbers, NaN for what is missing.

    A torn last line is left out. Raises ResultsError for any other damage, and for a cell that is
    no number where one is expected.
    """
    import pandas

    rows = [row for _, row in whole_lines(csv_file) if row is not None]
    texts = pandas.DataFrame(rows, columns=list(COLUMNS), dtype="object")
    texts = texts.where(texts != "")
    values = {
        name: texts[name] if column.words else _numbers(texts[name], csv_file)
        for name, column in COLUMNS.items()
    }
    return pandas.DataFrame(values)


def _numbers(texts: pandas.Series, csv_file: Path) -> pandas.Series:
    """The numbers of a column, which stand there as text."""
    import pandas

    numbers = pandas.to_numeric(texts, errors="coerce")
    wrong = texts[numbers.isna() & texts.notna()]
    if len(wrong):
        raise ResultsError(
            f"results {str(csv_file)!r}: line {wrong.index[0] + 2}: {texts.name} is "
            f"{wrong.iloc[0]!r}, expected a number"
        )
    return numbers
