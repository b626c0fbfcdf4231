"""Results on disk, complete at every moment.

The results file is locked while a batch writes it. Every row is one write, after its trace (and the
ego's output), and the manifest is replaced atomically. A process that is killed leaves at most one
torn row at the end, which ``resume`` takes off again; a full disk leaves none. A file that another
process removes, cuts or changes meanwhile is noticed before the next row: then nothing more is
written.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

from cavsumo.errors import BatchError, ResultsError
from cavsumo.results.columns import COLUMNS, Row
from cavsumo.results.inputs import FOLDER as INPUTS
from cavsumo.results.inputs import keep, remove_others
from cavsumo.results.own_file import OwnFile
from cavsumo.results.reading import (
    FORMAT,
    HEADER,
    STARTING,
    check_replaceable,
    ego_log_name,
    inside,
    whole_lines,
)
from cavsumo.results.rows import Outcome, row_line
from cavsumo.results.trace_file import PACKED, PLAIN, trace_name

RUNNING = "running"
UNENCODABLE = "backslashreplace"  # file names may contain invalid Unicode
BESIDE = (PACKED, PLAIN, ".ego.log")  # how the names of an episode's files end


@dataclass(frozen=True)
class Written:
    """The rows in a results file.

    Attributes:
        size: the number of bytes, the header included.
        sum: the SHA-256 of them.
        last: the number of the last episode, -1 for none.
        traces: how many rows have a trace.
    """

    size: int
    sum: hashlib._Hash
    last: int
    traces: int


class Recorder:
    """Writes a batch: manifest first and last, rows as they come; a context manager.

    Entering locks the results file and changes nothing; then either ``begin`` or ``resume``.

    Attributes:
        traces: how many rows have a trace.
    """

    def __init__(self, csv_file: Path) -> None:
        if csv_file.suffix != ".csv":  # the manifest and the traces take the other names
            raise ResultsError(f"results {str(csv_file)!r}: expected a name that ends in .csv")
        self.csv_file = csv_file
        self.manifest_file = csv_file.with_suffix(".json")
        self.trace_folder = csv_file.with_suffix("")
        self.traces = 0
        self.manifest: dict[str, Any] = {}
        self._begun = False
        self._last = -1  # the last episode among the whole rows

    def __enter__(self) -> Recorder:
        self._rows = OwnFile(self.csv_file)
        return self

    def __exit__(self, *_: object) -> None:
        if self._rows.created and not self._begun:  # no batch was begun: remove the created file
            self.csv_file.unlink(missing_ok=True)
        self._rows.close()

    def begin(self, manifest: Mapping[str, Any], *, overwrite: bool = False) -> None:
        """Start a batch in place of a finished one; raises ResultsError if that fails.

        Unfinished results and other files are only overwritten on request.
        """
        if not overwrite:
            check_replaceable(self.csv_file)
        try:
            self.manifest = dict(manifest)
            self._write_manifest(STARTING)
            self._begun = True
            self._start_rows()
        except OSError as error:
            raise self._cannot_start(error) from error

    def keep(self, files: Mapping[str, Path]) -> list[Path]:
        """Keep the inputs of the batch, by their checksums; returns those that are too large."""
        folder = self.trace_folder / INPUTS
        if folder.is_symlink():
            raise ResultsError(f"results {str(self.csv_file)!r}: {str(folder)!r} is a link")
        try:
            remove_others(folder, set(files))
            return [file for sha, file in files.items() if not keep(folder, file, sha)]
        except OSError as error:
            raise self._no_more(error) from error

    def resume(self, manifest: Mapping[str, Any], todo: Iterator[int]) -> Iterator[dict[str, str]]:
        """Continue after the existing rows, and yield them; call until exhausted.

        Args:
            manifest: the recorded one, with what has changed since.
            todo: the numbers of the batch's episodes in order; left behind the last one done.

        Raises ResultsError where the folder of traces is a link that leads out.
        """
        inside(self.csv_file, self.trace_folder.name)
        if manifest.get("status") != STARTING:
            yield from self._whole_rows(todo)
        self._go_on(manifest)

    def resume_after(self, manifest: Mapping[str, Any], written: Written) -> None:
        """Continue after rows that were read and checked already, else like ``resume``."""
        inside(self.csv_file, self.trace_folder.name)
        self._rows.adopt(written.size, written.sum)
        self._last, self.traces = written.last, written.traces
        self._go_on(manifest)

    def _go_on(self, manifest: Mapping[str, Any]) -> None:
        """Be ready for the row behind the existing ones."""
        try:
            self._begun = True
            self.manifest = {k: v for k, v in manifest.items() if k not in _FRAME}
            self._start_rows()
        except OSError as error:
            raise self._cannot_start(error) from error

    _has_folder = False  # whether there may be files beside the rows

    def write(self, outcome: Outcome) -> Row:
        """Append a row, its trace first; raises BatchError when the disk takes no more."""
        self._rows.check()
        row = self._with_trace(outcome)
        self._append(_line(row), row["run"])
        return row

    def copy(self, lines: bytes, last: int) -> None:
        """Append lines that are rows as ``write`` would write them, without any files.

        ``last``: the number of the last of them.
        """
        self._rows.check()
        self._append(lines, last)

    def _append(self, lines: bytes, last: int) -> None:
        """Append lines; none of them stays when the disk takes no more."""
        try:
            self._rows.append(lines)
        except OSError as error:
            raise self._no_more(error) from error
        self._last = last

    def replace(self, outcomes: Mapping[int, Outcome]) -> None:
        """Replace some rows, all at once or not at all."""
        self._rows.check()
        rows = {run: self._with_trace(outcome) for run, outcome in outcomes.items()}

        def line(old: bytes) -> bytes:
            row = rows.get(int(old.split(b",", 1)[0]))
            return old if row is None else _line(row)

        try:
            self._rows.replace(line)
        except OSError as error:
            raise self._no_more(error) from error

    def checkpoint(self, facts: Mapping[str, Any]) -> None:
        """Record facts in the manifest of the running batch."""
        self._rows.check()
        self.manifest.update(facts)
        try:
            self._write_manifest(RUNNING)
        except OSError as error:
            raise self._no_more(error) from error

    def finish(self, status: str, facts: Mapping[str, Any]) -> None:
        """Make the rows durable and complete the manifest."""
        self._rows.check()
        self.manifest.update(facts)
        try:
            self._rows.flush()
            self._write_manifest(status)
        except OSError as error:
            raise self._no_more(error) from error

    def _with_trace(self, outcome: Outcome) -> Row:
        """The row, naming its trace if there is one; that and the ego's log are written."""
        row, name = dict(outcome.row), trace_name(self.csv_file, outcome.row["run"])
        plain = trace_name(self.csv_file, row["run"], PLAIN)  # of a batch that 0.1 began
        self.traces -= self._put(plain, b"") + self._put(name, outcome.trace)
        self.traces += bool(outcome.trace)
        self._put(ego_log_name(self.csv_file, row["run"]), outcome.ego_log.encode("utf-8"))
        return row | {"trace": name} if outcome.trace else row

    def _put(self, name: str, content: bytes) -> bool:
        """Write a file beside the rows, none without content; returns whether one existed."""
        file = self.csv_file.parent / name
        there = self._has_folder and os.path.lexists(file)  # links are not followed
        if there:
            file.unlink()
        if content:
            try:
                self.trace_folder.mkdir(exist_ok=True)
                file.write_bytes(content)
            except OSError as error:
                with suppress(OSError):
                    file.unlink()
                raise self._no_more(error) from error
            self._has_folder = True
        return there

    def _whole_rows(self, todo: Iterator[int]) -> Iterator[dict[str, str]]:
        """The existing rows, which must be the first ones of the batch."""
        for line, row in whole_lines(self.csv_file):
            if row is None and line != HEADER.encode("utf-8"):
                raise ResultsError(
                    f"results {str(self.csv_file)!r}: were written by an earlier version, with "
                    "fewer columns; this version reads them and does not go on with them"
                )
            if row is not None:
                expected = next(todo, None)
                if row["run"] != str(expected):
                    due = f"run {expected} is due" if expected is not None else "the batch is over"
                    raise ResultsError(
                        f"results {str(self.csv_file)!r}: run {row['run']} where {due}"
                    )
                self._last = int(row["run"])
                self.traces += bool(row["trace"])
                yield row
            self._rows.note(line)

    def _start_rows(self) -> None:
        """Be ready for the row behind the whole ones, the header before the first."""
        self._rows.truncate()
        self._remove_traces(after=self._last)
        self._has_folder = self.trace_folder.is_dir()
        if not self._rows.size:
            self._rows.append(HEADER.encode("utf-8"))
        self._write_manifest(RUNNING)

    def _remove_traces(self, after: int) -> None:
        """Remove the traces and logs of later episodes, and nothing else."""
        if self.trace_folder.is_dir():
            for old in chain(*map(self.trace_folder.glob, (f"run*{end}" for end in BESIDE))):
                number = old.name.removeprefix("run").partition(".")[0]
                if number.isdecimal() and len(number) >= 6 and int(number) > after:
                    old.unlink()

    def _write_manifest(self, status: str) -> None:
        """Replace the manifest, all at once."""
        columns = {name: column.explanation for name, column in COLUMNS.items()}
        data = {"format": FORMAT, "status": status, **self.manifest, "columns": columns}
        text = json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False)
        new = self.manifest_file.with_name(f".{self.manifest_file.name}.new")
        try:
            new.unlink(missing_ok=True)  # it may be a link
            new.write_text(text + "\n", encoding="utf-8", errors=UNENCODABLE)
            new.replace(self.manifest_file)
        except OSError:
            new.unlink(missing_ok=True)
            raise

    def _cannot_start(self, error: OSError) -> ResultsError:
        """The error for a file that takes nothing."""
        return ResultsError(f"results {str(self.csv_file)!r}: cannot be written: {error.strerror}")

    def _no_more(self, error: OSError) -> BatchError:
        """The error for a full disk."""
        return BatchError(
            f"results {str(self.csv_file)!r}: cannot be written: {error.strerror}; "
            "the rows before are whole, --resume goes on from there"
        )


_FRAME = ("format", "status", "columns")  # keys that the recorder itself adds to a manifest


def _line(row: Row) -> bytes:
    """A row as it stands in the file."""
    return row_line(row).encode("utf-8", errors=UNENCODABLE)
