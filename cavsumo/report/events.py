"""What a trace tells of a test: how fast, from which side and where along the ego's way.

A test is described at its trigger, a failure also at its impact. Where no trace was kept, only the
closing speed of an impact is known, from the row.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas

from cavsumo.egos.base import EGO_KIND
from cavsumo.report.load import Evidence
from cavsumo.results import read_trace

FRONT, LEFT, RIGHT, REAR = "front", "left", "right", "rear"


class Event(NamedTuple):
    """A moment of a test; None for what is not known.

    Attributes:
        speed: closing speed, along the ego's heading [m/s].
        side: of the ego, where the tester's centre is: at the trigger left or right of the strip
            ahead or in its front; at an impact the side of the ego that was hit.
        place: how far the ego had driven since it entered [m].
        x, y: where the tester's centre was [m].
    """

    speed: float | None = None
    side: str | None = None
    place: float | None = None
    x: float | None = None
    y: float | None = None


class Described(NamedTuple):
    """A test: its trigger, and its impact if it was a failure."""

    trigger: Event
    impact: Event | None


def described(evidence: Evidence) -> dict[int, Described]:
    """Every test of the evidence, by the index of its row."""
    rows = evidence.rows
    tests = rows[rows["outcome"].isin(("held", "violated"))]
    return dict(_each(evidence, tests))


def _each(evidence: Evidence, tests: pandas.DataFrame) -> Iterator[tuple[int, Described]]:
    """The tests one by one; only one trace is in memory at a time."""
    for index, row in zip(tests.index, tests.to_dict("records"), strict=True):
        folder = evidence.batches[row["batch"]].csv_file.parent
        yield int(index), describe(row, folder)


def describe(row: Mapping[str, Any], folder: Path) -> Described:
    """One test, from its row and from the trace it names, relative to a folder."""
    frames = read_trace(folder / row["trace"]) if row["trace"] else []
    trigger = _event(frames, row["trigger_time_s"], row["tester"], impact=False)
    if row["outcome"] != "violated":
        return Described(trigger, None)
    impact = _event(frames, row["violation_time_s"], row["tester"], impact=True)
    speed = row["impact_speed_mps"]
    return Described(trigger, impact._replace(speed=None if math.isnan(speed) else speed))


def _event(frames: Sequence[Mapping[str, Any]], time: float, tester: str, *, impact: bool) -> Event:
    """The moment of a trace nearest to a time; nothing known without frames or tester."""
    if not frames or tester not in frames[0]["testers"]:
        return Event()
    i = min(range(len(frames)), key=lambda k: abs(frames[k]["time_s"] - time))
    ego, other = frames[i]["ego"], frames[i]["testers"][tester]
    way = [frame["ego"] for frame in frames[: i + 1]]
    place = sum(math.hypot(b[0] - a[0], b[1] - a[1]) for a, b in zip(way, way[1:], strict=False))
    speed = ego[2] - other[2] * math.cos(other[3] - ego[3])
    side = (side_hit if impact else side_ahead)(ego, other)
    return Event(speed, side, place, other[0], other[1])


def side_ahead(ego: Sequence[float], other: Sequence[float]) -> str:
    """Where a body is across the ego's heading; poses are [x, y, v, o]."""
    _, across = _seen(ego, other)
    if abs(across) <= EGO_KIND.width / 2:
        return FRONT
    return LEFT if across > 0 else RIGHT


def side_hit(ego: Sequence[float], other: Sequence[float]) -> str:
    """The side of the ego's box from which a body's centre is farthest out, or least deep inside.

    The box is that of cavsumo's egos, 5 m by 1.8 m.
    """
    along, across = _seen(ego, other)
    if abs(along) - EGO_KIND.length / 2 >= abs(across) - EGO_KIND.width / 2:
        return FRONT if along > 0 else REAR
    return LEFT if across > 0 else RIGHT


def _seen(ego: Sequence[float], other: Sequence[float]) -> tuple[float, float]:
    """A body's centre as the ego sees it: ahead and to the left [m]."""
    dx, dy, c, s = other[0] - ego[0], other[1] - ego[1], math.cos(ego[3]), math.sin(ego[3])
    return dx * c + dy * s, dy * c - dx * s
