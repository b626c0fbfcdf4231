"""The data of a test in its trace: closing speed, side of the ego, place along the ego's way.

A test is described at its trigger, a failure also at its impact. Where no trace was kept, only the
closing speed of an impact is known, from the row.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas

from cavsumo.egos.base import EGO_KIND
from cavsumo.report.load import Evidence
from cavsumo.results.reading import inside
from cavsumo.results.traces import read_moments

Pose = Sequence[float]  # x, y [m], v [m/s], o [rad]
Moment = tuple[float, dict[str, Any]]  # how far the ego has driven [m], the frame
FRONT, LEFT, RIGHT, REAR = "front", "left", "right", "rear"

USED = ["batch", "outcome", "tester", "trace", "trigger_time_s", "violation_time_s"]
USED += ["impact_speed_mps"]


class Event(NamedTuple):
    """A moment of a test; None for unknown values.

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


UNTRACED = Described(Event(), None)  # a test that the ego passed, of which nothing is known


def described(evidence: Evidence) -> dict[int, Described]:
    """Every test of the evidence, by the index of its row."""
    rows = evidence.rows
    tests = rows[rows["outcome"].isin(("held", "violated"))]
    nothing = (tests["outcome"] == "held") & (tests["trace"] == "")
    found = dict.fromkeys(tests.index[nothing].tolist(), UNTRACED)
    return found | dict(_each(evidence, tests[~nothing]))


def _each(evidence: Evidence, tests: pandas.DataFrame) -> Iterator[tuple[int, Described]]:
    """The tests one by one; only one row and one trace are in memory at a time."""
    cells = zip(*(tests[name] for name in USED), strict=True)
    for index, told in zip(tests.index.tolist(), cells, strict=True):
        row = dict(zip(USED, told, strict=True))
        yield index, describe(row, evidence.batches[row["batch"]].csv_file)


def describe(row: Mapping[str, Any], csv_file: Path) -> Described:
    """One test, from its row and from the trace it names, beside its results file."""
    failed = row["outcome"] == "violated"
    times = [row["trigger_time_s"], *([row["violation_time_s"]] if failed else [])]
    moments: Sequence[Moment | None] = [None] * len(times)
    if row["trace"]:
        moments = read_moments(inside(csv_file, row["trace"]), times)
    trigger = _event(moments[0], row["tester"], side_ahead)
    if not failed:
        return Described(trigger, None)
    speed = row["impact_speed_mps"]
    impact = _event(moments[1], row["tester"], side_hit)
    return Described(trigger, impact._replace(speed=None if math.isnan(speed) else speed))


def _event(moment: Moment | None, tester: str, side: Callable[[Pose, Pose], str]) -> Event:
    """A moment of a trace; all values are unknown without it or without the tester."""
    if moment is None or tester not in moment[1]["testers"]:
        return Event()
    place, frame = moment
    ego, other = frame["ego"], frame["testers"][tester]
    speed = ego[2] - other[2] * math.cos(other[3] - ego[3])
    return Event(speed, side(ego, other), place, other[0], other[1])


def side_ahead(ego: Pose, other: Pose) -> str:
    """The position of a body across the ego's heading."""
    _, across = _seen(ego, other)
    if abs(across) <= EGO_KIND.width / 2:
        return FRONT
    return LEFT if across > 0 else RIGHT


def side_hit(ego: Pose, other: Pose) -> str:
    """The side of the ego's box from which a body's centre is farthest out, or least deep inside.

    The box is that of cavsumo's egos, 5 m by 1.8 m.
    """
    along, across = _seen(ego, other)
    if abs(along) - EGO_KIND.length / 2 >= abs(across) - EGO_KIND.width / 2:
        return FRONT if along > 0 else REAR
    return LEFT if across > 0 else RIGHT


def _seen(ego: Pose, other: Pose) -> tuple[float, float]:
    """A body's centre in the ego's frame: ahead and to the left [m]."""
    dx, dy, c, s = other[0] - ego[0], other[1] - ego[1], math.cos(ego[3]), math.sin(ego[3])
    return dx * c + dy * s, dy * c - dx * s
