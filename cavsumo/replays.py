"""A recorded episode once more: the same row and the same frames, or where they part."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from cavsumo.errors import ResultsError
from cavsumo.outcomes import COLUMNS, Row, cell
from cavsumo.results import STARTING, read_manifest, read_rows, read_trace
from cavsumo.scenario import BatchPlan

# Columns that a replay does not reproduce: real time, and the file beside the row.
NOT_REPLAYED = ("wall_s", "trace")


def recorded_plan(csv_file: Path) -> tuple[BatchPlan, dict[str, Any]]:
    """The plan of a batch, and its manifest."""
    manifest = read_manifest(csv_file)
    if manifest.get("status") == STARTING:
        raise ResultsError(f"results {str(csv_file)!r}: a batch that was killed as it started")
    try:
        return BatchPlan.model_validate(manifest["plan"]), manifest
    except (KeyError, ValueError) as error:
        raise ResultsError(f"manifest of {str(csv_file)!r}: holds no valid plan") from error


def recorded_row(csv_file: Path, run: int) -> dict[str, str]:
    """The row of an episode."""
    rows = {row.get("run"): row for row in read_rows(csv_file)}
    if str(run) not in rows:
        raise ResultsError(f"results {str(csv_file)!r}: no run {run} among {len(rows)} rows")
    return rows[str(run)]


def recorded_frames(csv_file: Path, row: Mapping[str, str]) -> list[dict[str, Any]] | None:
    """The frames of an episode, None when none were kept."""
    return read_trace(csv_file.parent / row["trace"]) if row.get("trace") else None


def first_difference(
    row: Mapping[str, str],
    frames: Sequence[Mapping[str, Any]] | None,
    again: Row,
    frames_again: Sequence[Mapping[str, Any]],
) -> str | None:
    """Where a replay departs from the record: the timestep, the body and the quantity."""
    if frames is not None:
        for old, new in zip(frames, frames_again, strict=False):
            for difference in _frame_differences(old, new):
                return difference
        if len(frames) != len(frames_again):
            return f"{len(frames)} frames were recorded, {len(frames_again)} replayed"
    for column in COLUMNS:
        if column not in NOT_REPLAYED and row.get(column, "") != cell(again.get(column)):
            return f"{column}: recorded {row.get(column)!r}, replayed {cell(again.get(column))!r}"
    return None


def _frame_differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[str]:
    """The differences of two frames, body by body."""
    step = f"step {old['step']} ({old['time_s']:.3f} s)"
    for key in ("step", "time_s", "steering", "lights"):
        if old.get(key) != new.get(key):
            yield f"{step}: {key} recorded {old.get(key)!r}, replayed {new.get(key)!r}"
    old_bodies = {"ego": old["ego"], **old["testers"], **old["background"]}
    new_bodies = {"ego": new["ego"], **new["testers"], **new["background"]}
    for body in sorted(old_bodies.keys() ^ new_bodies.keys()):
        yield f"{step}: {body} is {'gone' if body in old_bodies else 'new'}"
    for body, state in old_bodies.items():
        for name, a, b in zip("xyvo", state, new_bodies.get(body, state), strict=True):
            if a != b:
                yield f"{step}: {body}.{name} recorded {a!r}, replayed {b!r}"
