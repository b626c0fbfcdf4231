"""Traces: what happened in an episode, and all that is needed to play it again elsewhere.

JSON lines. The first is the head: the row, the plan, what the agents knew before, the checksums of
the files, the versions, and the boxes of all bodies. Then one frame a timestep. The head holds
nothing that says how much of a batch was played, so a trace is the same in every shard.
"""

from __future__ import annotations

import itertools
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from cavsumo.errors import ResultsError, shown
from cavsumo.model.bodies import Body
from cavsumo.model.documents import json_of, read_text
from cavsumo.model.scenario import BatchPlan
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.network.site import Site
from cavsumo.results.columns import COLUMNS, Row
from cavsumo.results.provenance import EXTENT, traffic_checksum, versions
from cavsumo.results.rows import cell
from cavsumo.results.schema import check_frame, check_head, check_row
from cavsumo.sumo.options import OPTIONS

FORMAT = "cavsumo-trace-1"
# Columns that a replay does not reproduce: real time, and the file beside the row.
NOT_REPLAYED = ("wall_s", "trace")
# Settings that say how a batch is played and kept and not what its episodes are; what is known is
# the memory in the head.
MANNER = EXTENT | {"shard", "trace", "reset", "known"}
MEMORY_MOST = 100_000  # characters of what an agent knew; one that knew more is not kept


class Shape(NamedTuple):
    """The box of a body."""

    kind: str
    length: float  # m
    width: float  # m
    wheelbase: float  # m


@dataclass(frozen=True)
class Trace:
    """An episode as it was recorded.

    Attributes:
        head: all but the frames, see ``trace_head``.
        frames: one a timestep, see ``frame``.
    """

    head: Mapping[str, Any]
    frames: Sequence[Mapping[str, Any]]

    @property
    def row(self) -> dict[str, str]:
        """The row of the episode as text, without what no replay reproduces.

        A column that its writer did not know is empty.
        """
        return {c: "" for c in COLUMNS if c not in NOT_REPLAYED} | self.head["row"]

    def shapes(self) -> dict[str, Shape]:
        """The boxes of all bodies by their ids."""
        return {
            name: Shape(*entry["box"]) for entry in self.head["bodies"] for name in entry["ids"]
        }


def origin(plan: BatchPlan, site: Site, inputs: Mapping[str, str]) -> dict[str, Any]:
    """What the episodes of a plan have in common, for the heads of their traces.

    ``inputs``: the checksums of its files.
    """
    return {
        "plan": plan.model_dump(mode="json", exclude=set(MANNER)),
        "sha256": dict(inputs) | traffic_checksum(site),
        "versions": versions(),
        "sumo_options": dict(OPTIONS),
    }


def trace_head(
    origin: Mapping[str, Any], row: Row, memory: Any, snapshots: Iterable[Snapshot]
) -> dict[str, Any]:
    """The first line of a trace.

    Args:
        origin: see the function of that name.
        memory: what the agents knew before; left out, and said so, when it is large.
    """
    known = len(json.dumps(memory)) <= MEMORY_MOST
    return {
        "format": FORMAT,
        "row": {c: cell(row.get(c)) for c in COLUMNS if c not in NOT_REPLAYED},
        **origin,
        "memory": memory if known else None,
        "memory_kept": known,
        "bodies": _bodies(snapshots),
    }


def _bodies(snapshots: Iterable[Snapshot]) -> list[dict[str, Any]]:
    """Everybody in the order of appearance, those with the same box together."""
    met: dict[str, Body] = {}
    for snapshot in snapshots:
        for body in (snapshot.ego.body, *(t.body for t in snapshot.testers)):
            met.setdefault(body.id, body)
        for raw in snapshot.raw_background:
            met.setdefault(raw[0].id, raw[0])
    alike: dict[Shape, list[str]] = {}
    for name, (_, kind) in met.items():
        shape = Shape(kind.name, kind.length, kind.width, kind.wheelbase)
        alike.setdefault(shape, []).append(name)
    return [{"box": list(shape), "ids": names} for shape, names in alike.items()]


def frame(snapshot: Snapshot) -> dict[str, Any]:
    """A snapshot as one line of a trace: every body as [x, y, v, o], in full precision."""
    return {
        "step": snapshot.step,
        "time_s": snapshot.time,
        "ego": _pose(snapshot.ego),
        "steering": snapshot.ego_steering,
        "testers": {t.id: _pose(t) for t in snapshot.testers},
        "background": {b.id: _pose(b) for b in snapshot.background},
        "lights": "".join(snapshot.lights),
    }


def _pose(state: BodyState) -> list[float]:
    return [state.x, state.y, state.v, state.o]


def states(frame: Mapping[str, Any]) -> Iterator[tuple[str, str, list[float]]]:
    """Everybody in a frame: part (ego, tester or background), id and [x, y, v, o]."""
    yield "ego", "ego", frame["ego"]
    for part, key in (("tester", "testers"), ("background", "background")):
        for name, state in frame[key].items():
            yield part, name, state


def trace_text(head: Mapping[str, Any], frames: Iterable[Mapping[str, Any]]) -> str:
    """A trace as JSON lines."""
    return "".join(json.dumps(line, allow_nan=False) + "\n" for line in (head, *frames))


def read_trace(file: Path) -> Trace:
    """The trace in a file; raises ResultsError in one sentence."""
    text = read_text(file, "trace", ResultsError)
    try:
        return parsed(text)
    except ValueError as error:
        raise ResultsError(f"trace {str(file)!r}: cannot be read: {error}") from error


def parsed(text: str) -> Trace:
    """The trace that a text holds; raises ValueError, in plain words, when it holds none."""
    first, *lines = _lines(text)
    head = _head(first)
    trace = Trace(head, [_frame(line, i) for i, line in enumerate(lines, 2)])
    met = trace.shapes()
    for i, found in enumerate(trace.frames, 2):
        for _, name, _ in states(found):
            if name not in met:
                raise ValueError(f"line {i}: the head tells no shape of {shown(name)}")
    return trace


def _lines(text: str) -> list[str]:
    """The lines of a text: those that end with a line feed, and what stands behind the last."""
    lines = text.split("\n")
    return lines if lines[-1] or len(lines) == 1 else lines[:-1]


def _head(line: str) -> dict[str, Any]:
    """The first line of a trace."""
    try:
        found = json_of(line)
    except ValueError as error:
        raise ValueError(f"line 1: {error}") from error
    if not (isinstance(found, dict) and found.get("format") == FORMAT):
        raise ValueError(f"line 1 is not the head of a {FORMAT}")
    try:
        check_head(found)
        check_row(found["row"])
    except ValueError as error:
        raise ValueError(f"line 1: {error}") from error
    return found


def read_moments(file: Path, times: Sequence[float]) -> list[tuple[float, dict[str, Any]]]:
    """For each time [s] the nearest frame of a trace, and how far the ego has driven by then [m].

    Only those frames are parsed as a whole: traces are long, and a report reads thousands.
    """
    try:
        lines = _lines(read_text(file, "trace", ResultsError))[1:]  # the first is the head
        if not lines:
            raise ValueError("no frames")
        passing = list(map(_passing, lines))
        steps = (math.dist(a[1:], b[1:]) for a, b in itertools.pairwise(passing))
        driven = list(itertools.accumulate(steps, initial=0.0))
        nearest = [min(range(len(lines)), key=lambda i: abs(passing[i][0] - t)) for t in times]
        return [(driven[i], _frame(lines[i], i + 2)) for i in nearest]
    except ValueError as error:
        raise ResultsError(f"trace {str(file)!r}: cannot be read: {error}") from error


_POSE = re.compile(r'"time_s":\s*([^,]+),\s*"ego":\s*\[([^,]+),([^,]+),')


def _passing(line: str) -> tuple[float, float, float]:
    """The time [s] and the ego's position [m] in a line of a trace."""
    found = _POSE.search(line)
    if found is None:
        raise ValueError("a frame without time_s and ego, one after the other")
    try:
        time, x, y = map(float, found.groups())
    except ValueError:
        time = x = y = math.nan
    if not math.isfinite(time + x + y):
        raise ValueError(f"a frame at {shown(found.groups())}, expected numbers")
    return time, x, y


def _frame(line: str, number: int) -> dict[str, Any]:
    """A line of a trace, whose number is for messages."""
    try:
        found: dict[str, Any] = json_of(line, bounded=False)
        check_frame(found)
    except ValueError as error:
        raise ValueError(f"line {number}: {error}") from error
    return found
