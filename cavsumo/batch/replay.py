"""Recorded episodes: read from results or a trace, played again, compared bit for bit."""

from __future__ import annotations

import dataclasses
import shlex
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from cavsumo.batch.choosers import chosen
from cavsumo.batch.jobs import Job, Memory, job
from cavsumo.batch.messages import Answer
from cavsumo.batch.prepared import PreparedBatch, prepare
from cavsumo.batch.trust import check_trust
from cavsumo.batch.worker import Worker
from cavsumo.errors import DivergenceError, InputError, ResultsError, shown
from cavsumo.model.bodies import STEERING, THROTTLE
from cavsumo.model.named_networks import ENDING, is_named
from cavsumo.model.scenario import BatchPlan
from cavsumo.results.columns import COLUMNS, Row
from cavsumo.results.reading import check_cells, inside, rows_of
from cavsumo.results.recorded_plan import plan_in, recorded_plan
from cavsumo.results.rows import cell
from cavsumo.results.traces import NOT_REPLAYED, Trace, read_trace, trace_of
from cavsumo.suites.cases import case_plan


@dataclass(frozen=True)
class Record:
    """A recorded episode.

    Attributes:
        plan: of its batch.
        row: the episode's row, as text.
        trace: its trace, None when none was kept.
        origin: the batch's manifest, or the trace's head: versions and checksums.
        file: the file that contains it.
        alone: whether that is a trace, without the episodes before it.
        allowed: the external egos and assertions that it may use; None for all (``trust``).
    """

    plan: BatchPlan
    row: Mapping[str, str]
    trace: Trace | None
    origin: Mapping[str, Any]
    file: Path
    alone: bool = False
    allowed: Collection[str] | None = ()

    @property
    def run(self) -> int:
        """The number of the episode in its batch."""
        return int(self.row["run"])

    @property
    def command(self) -> str:
        """The command that replays it."""
        return f"cavsumo replay {shlex.quote(self.file.name)}" + (
            "" if self.alone else f" {self.run}"
        )


class Replayed(NamedTuple):
    """An episode that was played again: its row, and its trace, None after an error."""

    row: Row
    trace: Trace | None


class Difference(NamedTuple):
    """The first difference of a replay from the record; see ``DivergenceError``."""

    place: str
    what: str
    step: int | None
    body: str = ""
    quantity: str = ""


# Found


def recorded(csv_file: Path, run: int, allowed: Collection[str] | None = ()) -> Record:
    """An episode of a batch."""
    plan, manifest = recorded_plan(csv_file)
    row = recorded_row(csv_file, run)
    trace = read_trace(inside(csv_file, row["trace"])) if row.get("trace") else None
    own = _case_of(plan, run, trace)
    origin = manifest if plan.suite is None else _origin_of(manifest, plan.suite.name, own)
    return Record(own, row, trace, origin, csv_file, allowed=allowed)


def _case_of(plan: BatchPlan, run: int, trace: Trace | None) -> BatchPlan:
    """The plan of one run: of a suite that in its trace, for which the suite's file may be gone."""
    if plan.suite is None or trace is None:
        return case_plan(plan, run)
    return plan_in(trace.head, f"trace of run {run}")


def _origin_of(manifest: Mapping[str, Any], suite: str, own: BatchPlan) -> dict[str, Any]:
    """The manifest without the checksums of a suite and of the networks of its other cases."""

    def of_others(name: str) -> bool:
        net = is_named(Path(name)) or ENDING in name
        return name == suite or (net and name != str(own.scenario.net))

    sums = dict(manifest.get("sha256") or {})
    return {**manifest, "sha256": {k: v for k, v in sums.items() if not of_others(k)}}


def recorded_row(csv_file: Path, run: int) -> dict[str, str]:
    """The row of an episode."""
    rows = {row.get("run"): row for row in rows_of(csv_file, filled=False)}
    if str(run) not in rows:
        raise ResultsError(f"results {str(csv_file)!r}: no run {run} among {len(rows)} rows")
    check_cells(csv_file, rows[str(run)])
    return rows[str(run)]


def recorded_alone(
    file: Path, allowed: Collection[str] | None = (), *, anew: bool = True
) -> Record:
    """The episode in a trace; raises ResultsError when it cannot be played from that alone.

    ``anew``: whether its agents are to play, and not only what they did; see ``check_played``.
    """
    trace, name = read_trace(file), f"trace {str(file)!r}"
    head = trace.head
    plan, row, kept = plan_in(head, name), trace.row, head["memory_kept"]
    if row["agent"] not in plan.cast:
        raise ResultsError(f"{name}: its plan has no agent {shown(row['agent'])}")
    if row["reset"] == "shared":
        raise ResultsError(
            f"{name}: was played in a simulation that other episodes had used before, and is not "
            "played so any more"
        )
    if anew and not kept and trace.has_recording:
        raise ResultsError(
            f"{name}: does not hold what agent {row['agent']} had learned before, which is large; "
            "replay it from its results, or play it back with --playback"
        )
    return Record(plan, row, trace, head, file, alone=True, allowed=allowed)


def check_played(record: Record) -> None:
    """Raise InputError for a trace that nothing plays: an imported one has no actions."""
    trace = record.trace
    if record.alone and trace and not (trace.has_recording or trace.head["memory_kept"]):
        raise InputError(
            f"trace {str(record.file)!r}: has tracks without actions, as imported episodes have, "
            f"so nothing plays it again; show it with: {record.command} --recorded --html FILE"
        )


# Played again


def prepared_again(record: Record) -> PreparedBatch:
    """The prepared batch of a record; raises InputError for names that need ``--trust``."""
    check_trust(record.plan.scenario, record.file, record.allowed)
    return prepare(record.plan)


def replayed(worker: Worker, record: Record) -> Replayed:
    """An episode once more, after the earlier episodes on which it depends.

    Learners first play their earlier episodes, or get their knowledge from the trace if it stands
    alone.
    """
    outcome = _played_again(worker, record).outcome
    return Replayed(outcome.row, trace_of(outcome))


def _played_again(worker: Worker, record: Record) -> Answer:
    """The answer of its worker."""
    plan, run = worker.prepared.plan, record.run
    if record.alone and record.trace is not None:
        row, memory = record.row, record.trace.head["memory"]
        source = f"trace {str(record.file)!r}: memory"
        worker.prepared.cast.check_memory(row["agent"], memory, source)
        again = Job(run, row["agent"], int(row["seed"]), memory, record=True)
        return worker.play(again)
    return worker.play(dataclasses.replace(job(plan, run, known(worker, record)), record=True))


def known(worker: Worker, record: Record) -> Memory | None:
    """The knowledge of an episode's agents before it.

    A learner plays its earlier episodes; that of a search or an estimate follows from their rows.
    """
    plan, run = worker.prepared.plan, record.run
    step, label, memory = len(plan.agents), record.row["agent"], job(plan, run).memory
    if label in worker.prepared.cast.searchers:
        return chosen(worker.prepared, label, rows_of(record.file), run)
    learns = label in worker.prepared.cast.learners
    for earlier in range(run % step, run, step) if learns else ():
        memory = worker.play(job(plan, earlier, memory)).memory
    return memory


# Compared


def compare(record: Record, again: Replayed, apart: Collection[str] = ()) -> None:
    """Raise DivergenceError at the first difference of a replay from its record.

    ``apart``: columns of the row that it need not reproduce.
    """
    name = f"run {record.run} ({record.row['agent']})"
    if again.row["outcome"] == "error" != record.row["outcome"]:
        said = f"{name} could not be played again: {again.row['error']}"
        raise DivergenceError(said, None, "", "outcome")
    frames = record.trace.frames if record.trace is not None else None
    frames_again = again.trace.frames if again.trace is not None else ()
    found = first_difference(record.row, frames, again.row, frames_again, apart)
    if found is not None:
        place, what, step, body, quantity = found
        raise DivergenceError(f"{name} diverged at {place}: {what}", step, body, quantity)


def first_difference(
    row: Mapping[str, str],
    frames: Sequence[Mapping[str, Any]] | None,
    again: Row,
    frames_again: Sequence[Mapping[str, Any]],
    apart: Collection[str] = (),
) -> Difference | None:
    """The first difference of a replay from its record: the timestep, the body and the quantity."""
    if frames is not None:
        for old, new in zip(frames, frames_again, strict=False):
            for difference in _frame_differences(old, new):
                return difference
        if len(frames) != len(frames_again):
            end = min(len(frames), len(frames_again))
            what = f"{len(frames)} frames were recorded, {len(frames_again)} replayed"
            return Difference("the end of the trace", what, end, quantity="frames")
    for column in COLUMNS:
        if column not in row:  # of a version before it had the column
            continue
        if column in NOT_REPLAYED or column in apart:
            continue
        if row[column] != cell(again.get(column)):
            what = f"recorded {row[column]!r}, replayed {cell(again.get(column))!r}"
            return Difference("the row", f"{column} {what}", None, quantity=column)
    return None


def _frame_differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[Difference]:
    """The differences of two frames, body by body."""
    step = old["step"]
    place = f"step {step} ({old['time_s']:.3f} s)"
    for key in ("step", "time_s", "steering", "lights"):
        if old.get(key) != new.get(key):
            what = f"{key} recorded {old.get(key)!r}, replayed {new.get(key)!r}"
            yield Difference(place, what, step, quantity=key)
    old_bodies = {"ego": old["ego"], **old["testers"], **old["background"]}
    new_bodies = {"ego": new["ego"], **new["testers"], **new["background"]}
    for body in sorted(old_bodies.keys() ^ new_bodies.keys()):
        what = f"{body} is {'gone' if body in old_bodies else 'new'}"
        yield Difference(place, what, step, body)
    for body, state in old_bodies.items():
        for name, a, b in zip("xyvo", state, new_bodies.get(body, state), strict=True):
            if a != b:
                what = f"{body}.{name} recorded {a!r}, replayed {b!r}"
                yield Difference(place, what, step, body, name)
    yield from _action_differences(old, new, place)


def _action_differences(
    old: Mapping[str, Any], new: Mapping[str, Any], place: str
) -> Iterator[Difference]:
    """The differences of what the testers did; a trace of format 1 does not tell."""
    chosen, chosen_again = old.get("actions", new["actions"]), new["actions"]
    if len(chosen) != len(chosen_again):
        what = f"{len(chosen)} actions were recorded, {len(chosen_again)} replayed"
        yield Difference(place, what, old["step"], quantity="actions")
    for body, one, again in zip(old["testers"], chosen, chosen_again, strict=False):
        for name, a, b in zip((THROTTLE, STEERING), one, again, strict=True):
            if a != b:
                what = f"{body}.{name} recorded {a!r}, replayed {b!r}"
                yield Difference(place, what, old["step"], body, name)
