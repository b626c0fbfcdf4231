"""Traces: the record of an episode, with all data for playing it again on another machine.

JSON lines, compressed (``trace_file``). The first is the head: the row, the plan, what the agents
knew before, the checksums of the files, the versions, the boxes of all bodies, where the testers
started, and who of the background departed. Then one frame a timestep, with what the testers chose
then (``frame_text``). The head holds nothing that says how much of a batch was played, so a trace
is the same in every shard.
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

from cavsumo.agents.recorded import Recorded
from cavsumo.errors import ResultsError, shown
from cavsumo.model.bodies import Body
from cavsumo.model.documents import json_of
from cavsumo.model.scenario import BatchPlan
from cavsumo.model.snapshot import Snapshot
from cavsumo.network.site import Site
from cavsumo.results.columns import COLUMNS, Row
from cavsumo.results.provenance import EXTENT, traffic_checksum, versions
from cavsumo.results.recording import recording, recording_head
from cavsumo.results.rows import Outcome, cell
from cavsumo.results.schema import check_frame, check_head, check_row
from cavsumo.results.trace_file import read_trace_text, unpacked
from cavsumo.sumo.options import OPTIONS

FORMAT = "cavsumo-trace-2"
FORMATS = ("cavsumo-trace-1", FORMAT)  # the first has neither starts, actions nor departures
# Columns that a replay does not reproduce: real time, and the file beside the row.
NOT_REPLAYED = ("wall_s", "trace")
# Settings that say how a batch is played and kept and not what its episodes are; what is known is
# the memory in the head.
MANNER = EXTENT | {"shard", "trace", "known"}
MEMORY_MOST = 100_000  # characters of what an agent knew; one that knew more is not kept
STOOD_MPS = 1e-3  # slower than this a body stands


class Shape(NamedTuple):
    """The box of a body."""

    kind: str
    length: float  # m
    width: float  # m
    wheelbase: float  # m


@dataclass(frozen=True)
class Trace:
    """A recorded episode.

    Attributes:
        head: all but the frames, see ``trace_head``.
        frames: one a timestep, see ``frame_text``.
    """

    head: Mapping[str, Any]
    frames: Sequence[Mapping[str, Any]]

    @property
    def has_recording(self) -> bool:
        """Whether it holds what was done and not only where everybody was."""
        return bool(self.head["format"] != FORMATS[0])

    def recording(self) -> Recorded:
        """The data for playing the episode back; raises ResultsError where they are damaged."""
        return recording(self.head, self.frames)

    @property
    def row(self) -> dict[str, str]:
        """The row of the episode as text, without the columns that a replay does not reproduce.

        A column that its writer did not know is empty.
        """
        row: dict[str, str] = self.head["row"]
        return {c: "" for c in COLUMNS if c not in NOT_REPLAYED} | row

    def shapes(self) -> dict[str, Shape]:
        """The boxes of all bodies by their ids."""
        return {
            name: Shape(*entry["box"]) for entry in self.head["bodies"] for name in entry["ids"]
        }


def origin(plan: BatchPlan, site: Site, inputs: Mapping[str, str]) -> dict[str, Any]:
    """The common part of the heads of a plan's traces.

    ``inputs``: the checksums of its files.
    """
    return {
        "plan": plan.model_dump(mode="json", exclude=set(MANNER)),
        "sha256": dict(inputs) | traffic_checksum(site),
        "versions": versions(),
        "sumo_options": dict(OPTIONS),
    }


def trace_head(
    origin: Mapping[str, Any],
    row: Row,
    memory: Any,
    snapshots: Iterable[Snapshot],
    played: Recorded,
) -> dict[str, Any]:
    """The first line of a trace.

    Args:
        origin: see the function of that name.
        memory: what the agents knew before; left out, and said so, when it is large.
        played: what it takes to play the episode back.
    """
    known = len(json.dumps(memory)) <= MEMORY_MOST
    return {
        "format": FORMAT,
        "row": {c: cell(row.get(c)) for c in COLUMNS if c not in NOT_REPLAYED},
        **origin,
        "memory": memory if known else None,
        "memory_kept": known,
        "bodies": _bodies(snapshots),
        **recording_head(played),
    }


def _bodies(snapshots: Iterable[Snapshot]) -> list[dict[str, Any]]:
    """All bodies in the order of appearance, those with the same box together."""
    met: dict[str, Body] = {}
    for snapshot in snapshots:
        if not met:  # the ego and the testers are in all of them
            met = {state.body.id: state.body for state in (snapshot.ego, *snapshot.testers)}
        for raw in snapshot.raw_background:
            if raw[0].id not in met:
                met[raw[0].id] = raw[0]
    alike: dict[Shape, list[str]] = {}
    for name, (_, kind) in met.items():
        shape = Shape(kind.name, kind.length, kind.width, kind.wheelbase)
        alike.setdefault(shape, []).append(name)
    return [{"box": list(shape), "ids": names} for shape, names in alike.items()]


def states(frame: Mapping[str, Any]) -> Iterator[tuple[str, str, list[float]]]:
    """All bodies in a frame: part (ego, tester or background), id and [x, y, v, o]."""
    yield "ego", "ego", frame["ego"]
    for part, key in (("tester", "testers"), ("background", "background")):
        for name, state in frame[key].items():
            yield part, name, state


def last_stood(speeds: Iterable[float]) -> int | None:
    """The last of some moments at which a body stood, by its speeds [m/s]; None if it never did."""
    stood = [i for i, speed in enumerate(speeds) if speed < STOOD_MPS]
    return stood[-1] if stood else None


def trace_text(head: Mapping[str, Any], frames: str) -> str:
    """A trace as JSON lines, from its head and the text of its frames."""
    return f"{json.dumps(head, allow_nan=False)}\n{frames}"


def read_trace(file: Path) -> Trace:
    """The trace in a file; raises ResultsError in one sentence."""
    text = read_trace_text(file)
    try:
        return parsed(text)
    except UnknownFormat as error:
        raise ResultsError(f"trace {str(file)!r}: {error}") from error
    except ValueError as error:
        raise ResultsError(f"trace {str(file)!r}: cannot be read: {error}") from error


def trace_of(outcome: Outcome) -> Trace | None:
    """The trace of an episode that was just played; None where none was kept."""
    return parsed(unpacked(outcome.trace)) if outcome.trace else None


class UnknownFormat(ValueError):
    """A trace of a format that this version does not read."""


def parsed(text: str) -> Trace:
    """The trace in a text; raises ValueError, in plain words, for invalid text."""
    first, *lines = _lines(text)
    head = _head(first)
    acted = head["format"] != FORMATS[0]
    trace = Trace(head, [_frame(line, i, acted=acted) for i, line in enumerate(lines, 2)])
    met = trace.shapes()
    for i, found in enumerate(trace.frames, 2):
        for _, name, _ in states(found):
            if name not in met:
                raise ValueError(f"line {i}: the head tells no shape of {shown(name)}")
    return trace


def _lines(text: str) -> list[str]:
    """The lines of a text: those that end with a line feed, and the rest behind the last."""
    lines = text.split("\n")
    return lines if lines[-1] or len(lines) == 1 else lines[:-1]


def _head(line: str) -> dict[str, Any]:
    """The first line of a trace; raises UnknownFormat for a format that is not read."""
    try:
        found = json_of(line)
    except ValueError as error:
        raise ValueError(f"line 1: {error}") from error
    if not (isinstance(found, dict) and isinstance(found.get("format"), str)):
        raise ValueError("line 1 is not the head of a trace")
    if found["format"] not in FORMATS:
        said, known = " ".join(found["format"].split())[:40], " and ".join(FORMATS)
        raise UnknownFormat(f"format {said}, this version reads {known}")
    try:
        check_head(found)
        check_row(found["row"])
    except ValueError as error:
        raise ValueError(f"line 1: {error}") from error
    return found


def read_moments(file: Path, times: Sequence[float]) -> list[tuple[float, dict[str, Any]]]:
    """For each time [s] the nearest frame of a trace, and the ego's distance driven by then [m].

    Only those frames are parsed completely, because traces are long and a report reads thousands.
    """
    try:
        first, *lines = _lines(read_trace_text(file))
        acted = _head(first)["format"] != FORMATS[0]
        if not lines:
            raise ValueError("no frames")
        passing = list(map(_passing, lines))
        steps = (math.dist(a[1:], b[1:]) for a, b in itertools.pairwise(passing))
        driven = list(itertools.accumulate(steps, initial=0.0))
        nearest = [min(range(len(lines)), key=lambda i: abs(passing[i][0] - t)) for t in times]
        return [(driven[i], _frame(lines[i], i + 2, acted=acted)) for i in nearest]
    except UnknownFormat as error:
        raise ResultsError(f"trace {str(file)!r}: {error}") from error
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


def _frame(line: str, number: int, *, acted: bool) -> dict[str, Any]:
    """A line of a trace, whose number is for messages; ``acted``: it has to hold actions."""
    try:
        found: dict[str, Any] = json_of(line, bounded=False)
        check_frame(found, acted=acted)
    except ValueError as error:
        raise ValueError(f"line {number}: {error}") from error
    return found
