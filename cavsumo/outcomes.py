"""Rows, manifest and traces: how what happened is written, and read again."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cavsumo.assertions.base import VIOLATED
from cavsumo.errors import ResultsError
from cavsumo.snapshot import BodyState, Snapshot

if TYPE_CHECKING:
    import pandas

# The columns of results.csv with their meaning, in order; interface of everything downstream.
COLUMNS: Mapping[str, str] = {
    "run": "number of the episode in the batch, from 0; the key for replay",
    "agent": "tester agent",
    "ego": "vehicle under test",
    "testers": "number of tester bodies",
    "embodiment": "how SUMO was shown the testers: vehicle or person",
    "sumo_width_m": "width that SUMO was shown of a tester pedestrian",
    "seed": "the episode's seed, derived from the batch's seed and the number of the episode",
    "outcome": "violated, held, not_triggered, unfair or error",
    "assertion": "the assertion first violated, else triggered",
    "tester": "the tester's body involved",
    "trigger_time_s": "when the precondition triggered",
    "violation_time_s": "when the assertion was violated",
    "time_s": "length of the episode",
    "steps": "length of the episode in timesteps",
    "min_gap_m": "smallest gap between the ego and a tester",
    "min_ttc_s": "smallest time to collision (not measured in this version)",
    "max_drac_mps2": "largest deceleration to avoid a crash (not measured in this version)",
    "pet_s": "post-encroachment time (not measured in this version)",
    "ego_speed_mps": "speed of the ego at the violation, else at the trigger",
    "impact_speed_mps": "closing speed along the ego's heading at contact",
    "max_decel_mps2": "hardest braking of the ego",
    "avoidable": "whether the ego could still have avoided it (not judged in this version)",
    "cost": "time that the testers spent on the carriageway, together [s]",
    "reward": "the testers' return, undiscounted",
    "contacts": "bodies that touched the ego, standing or moving",
    "tester_contacts": "pairs of a tester and a body other than the ego that touched",
    "sumo_collisions": "pairs with the ego that SUMO itself reported as colliding",
    "background_collisions": "pairs without the ego that SUMO itself reported",
    "emergency_stops": "emergency stops that SUMO reported",
    "teleports": "teleports that SUMO reported",
    "trace": "frames, relative to this file",
    "error": "what went wrong when outcome is error",
    "wall_s": "real time; the only column that is not reproducible",
}
Row = dict[str, Any]
FORMAT = "cavsumo-results-1"
FRAME_KEYS = {"step", "time_s", "ego", "steering", "testers", "background"}


@dataclass(frozen=True)
class Outcome:
    """One finished episode: its row and the frames worth keeping."""

    row: Row
    frames: list[dict[str, Any]]


def cell(value: Any) -> str:
    """A value as it stands in the CSV: empty for nothing, floats to three decimals."""
    if value is None or value == "":
        return ""
    if isinstance(value, float):
        return "" if not math.isfinite(value) else f"{value:.3f}".replace("-0.000", "0.000")
    return str(value)


def frame(snapshot: Snapshot) -> dict[str, Any]:
    """A snapshot as one line of a trace: every body as [x, y, v, o], in full precision."""
    return {
        "step": snapshot.step,
        "time_s": snapshot.time,
        "ego": _pose(snapshot.ego),
        "steering": snapshot.ego_steering,
        "testers": {t.id: _pose(t) for t in snapshot.testers},
        "background": {b.id: _pose(b) for b in snapshot.background},
    }


def _pose(state: BodyState) -> list[float]:
    return [state.x, state.y, state.v, state.o]


class ResultsWriter:
    """Writes a batch: manifest first and last, rows as they come, traces beside them."""

    def __init__(self, csv_file: Path, manifest: Mapping[str, Any]) -> None:
        if csv_file.suffix != ".csv":  # the manifest and the traces take the other names
            raise ResultsError(f"results {str(csv_file)!r}: expected a name that ends in .csv")
        self.csv_file = csv_file
        self.manifest_file = csv_file.with_suffix(".json")
        self.trace_folder = csv_file.with_suffix("")
        self.traces = 0
        self.manifest = dict(manifest)
        try:
            self._clear()
            self._write_manifest("running")
            self._stream = csv_file.open("w", encoding="utf-8", newline="")
        except OSError as error:
            raise ResultsError(
                f"results {str(csv_file)!r}: cannot be written: {error.strerror}"
            ) from error
        self._csv = csv.writer(self._stream, lineterminator="\n")
        self._csv.writerow(COLUMNS)

    def write(self, outcome: Outcome) -> Row:
        """Append a row, its trace first, so that no row names a trace that is not there."""
        row = dict(outcome.row)
        if outcome.frames:
            name = f"run{row['run']:06d}.jsonl"
            self.trace_folder.mkdir(exist_ok=True)
            write_trace(self.trace_folder / name, row, outcome.frames)
            row["trace"] = f"{self.trace_folder.name}/{name}"
            self.traces += 1
        self._csv.writerow([cell(row.get(column)) for column in COLUMNS])
        self._stream.flush()
        return row

    def finish(self, status: str, facts: Mapping[str, Any]) -> None:
        """Close the rows and complete the manifest."""
        self._stream.close()
        self.manifest.update(facts)
        self._write_manifest(status)

    def _clear(self) -> None:
        """Remove the traces of an earlier batch of the same name, and nothing else."""
        if self.trace_folder.is_dir():
            for old in self.trace_folder.glob("run*.jsonl"):
                if old.stem.removeprefix("run").isdecimal():
                    old.unlink()

    def _write_manifest(self, status: str) -> None:
        data = {"format": FORMAT, "status": status, **self.manifest, "columns": dict(COLUMNS)}
        text = json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False)
        self.manifest_file.write_text(text + "\n", encoding="utf-8")


def write_trace(file: Path, row: Row, frames: Iterable[Mapping[str, Any]]) -> None:
    """A trace as JSON lines: the row's identity, then one frame a timestep."""
    head = {key: row[key] for key in ("run", "agent", "ego", "seed", "outcome", "tester")}
    with file.open("w", encoding="utf-8") as stream:
        for line in (head, *frames):
            stream.write(json.dumps(line, allow_nan=False) + "\n")


def read_trace(file: Path) -> list[dict[str, Any]]:
    """The frames of a trace."""
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
        frames = [json.loads(line) for line in lines[1:]]
        for found in frames:
            if not set(found) >= FRAME_KEYS:
                raise ValueError(f"a frame without {', '.join(sorted(FRAME_KEYS - set(found)))}")
        return frames
    except (OSError, ValueError, TypeError) as error:
        raise ResultsError(f"trace {str(file)!r}: cannot be read: {error}") from error


def read_manifest(csv_file: Path) -> dict[str, Any]:
    """The manifest that belongs to a results file."""
    file = csv_file.with_suffix(".json")
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, json.JSONDecodeError) as error:
        raise ResultsError(f"manifest {str(file)!r}: cannot be read: {error}") from error
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise ResultsError(f"manifest {str(file)!r}: is not of the format {FORMAT}")
    return data


def read_rows(csv_file: Path) -> list[dict[str, str]]:
    """The rows of a results file, as text."""
    try:
        with csv_file.open(encoding="utf-8", newline="") as stream:
            reader = csv.DictReader(stream)
            missing = [column for column in COLUMNS if column not in (reader.fieldnames or ())]
            if missing:
                raise ResultsError(f"results {str(csv_file)!r}: no column {missing[0]!r}")
            return list(reader)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ResultsError(f"results {str(csv_file)!r}: cannot be read: {error}") from error


def read_results(csv_file: Path) -> pandas.DataFrame:
    """The rows as a pandas table, numbers as numbers."""
    import pandas

    try:
        return pandas.read_csv(csv_file)
    except (OSError, ValueError) as error:
        raise ResultsError(f"results {str(csv_file)!r}: cannot be read: {error}") from error


def is_failure(row: Mapping[str, Any]) -> bool:
    """Whether the ego violated an assertion in this episode."""
    return bool(row["outcome"] == VIOLATED)
