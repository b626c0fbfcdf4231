"""Recorded episodes: found in results or alone in a trace, played again, compared bit for bit."""

from __future__ import annotations

import dataclasses
import shlex
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from cavsumo.batch.jobs import Job, Memory, job
from cavsumo.batch.messages import Answer
from cavsumo.batch.prepared import PreparedBatch, prepare
from cavsumo.batch.trust import check_trust
from cavsumo.batch.worker import Worker, search
from cavsumo.errors import DivergenceError, InputError, ResultsError, shown
from cavsumo.model.checksums import checksum
from cavsumo.model.documents import first_problem
from cavsumo.model.named_networks import check_network, network_file, routes_file
from cavsumo.model.scenario import BatchPlan, Scenario
from cavsumo.results.columns import COLUMNS, Row
from cavsumo.results.reading import STARTING, check_cells, inside, read_manifest, read_rows
from cavsumo.results.rows import cell
from cavsumo.results.traces import NOT_REPLAYED, Trace, parsed, read_trace


@dataclass(frozen=True)
class Record:
    """An episode as it was recorded.

    Attributes:
        plan: of its batch.
        row: the episode's row, as text.
        trace: its trace, None when none was kept.
        origin: the batch's manifest, or the trace's head: versions and checksums.
        file: where it was found.
        alone: whether that is a trace, without the episodes before it.
        allowed: the egos and assertions from outside that it may use; None for all (``trust``).
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
        """What plays it again."""
        return f"cavsumo replay {shlex.quote(self.file.name)}" + (
            "" if self.alone else f" {self.run}"
        )


class Replayed(NamedTuple):
    """An episode that was played again: its row, and its trace, None when an error left none."""

    row: Row
    trace: Trace | None


class Difference(NamedTuple):
    """Where a replay first departs from the record; see ``DivergenceError``."""

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
    return Record(plan, row, trace, manifest, csv_file, allowed=allowed)


def recorded_plan(csv_file: Path) -> tuple[BatchPlan, dict[str, Any]]:
    """The plan of a batch, and its manifest."""
    manifest = read_manifest(csv_file)
    if manifest.get("status") == STARTING:
        raise ResultsError(f"results {str(csv_file)!r}: a batch that was killed as it started")
    return _plan(manifest, f"manifest of {str(csv_file)!r}"), manifest


def _plan(origin: Mapping[str, Any], name: str) -> BatchPlan:
    """The plan in a manifest or in the head of a trace."""
    try:
        return BatchPlan.model_validate(origin["plan"])
    except KeyError:
        raise ResultsError(f"{name}: holds no valid plan") from None
    except ValidationError as error:
        raise ResultsError(f"{name}: holds no valid plan: {first_problem(error)}") from error


def recorded_row(csv_file: Path, run: int) -> dict[str, str]:
    """The row of an episode."""
    rows = {row.get("run"): row for row in read_rows(csv_file)}
    if str(run) not in rows:
        raise ResultsError(f"results {str(csv_file)!r}: no run {run} among {len(rows)} rows")
    check_cells(csv_file, rows[str(run)])
    return rows[str(run)]


def recorded_alone(file: Path, allowed: Collection[str] | None = ()) -> Record:
    """The episode in a trace; raises ResultsError when it cannot be played from that alone."""
    trace, name = read_trace(file), f"trace {str(file)!r}"
    head = trace.head
    plan, row, kept = _plan(head, name), trace.row, head["memory_kept"]
    if row["agent"] not in plan.cast:
        raise ResultsError(f"{name}: its plan has no agent {shown(row['agent'])}")
    if row["reset"] == "shared":
        raise ResultsError(
            f"{name}: was played in a simulation that other episodes used before; replay it from "
            "its results"
        )
    if not kept:
        raise ResultsError(
            f"{name}: does not hold what agent {row['agent']} had learned before, which is large; "
            "replay it from its results"
        )
    return Record(plan, row, trace, head, file, alone=True, allowed=allowed)


def located(record: Record, net: Path | None, routes: Path | None) -> Record:
    """The record with its files where they are here, known by their checksums.

    Each is looked for where it is said to be, else where it was recorded and beside the trace; a
    network that has a name is found by it.
    Raises InputError when it is nowhere, or another one.
    """
    scenario = record.plan.scenario
    if net is not None:
        check_network(net, "--net")
        net = network_file(net)
    here = {"net": _file(record, "--net", scenario.net, net)}
    if scenario.routes is not None:
        here["routes"] = _file(record, "--routes", scenario.routes, routes)
    more = tuple(_file(record, "additional", file, None) for file in scenario.additional)
    moved = scenario.model_copy(update={**here, "additional": more})
    known = dict(record.origin.get("sha256") or {})
    for was, now in zip(_files(scenario), _files(moved), strict=True):
        known[str(now)] = known.pop(str(was))
    return dataclasses.replace(
        record,
        plan=record.plan.model_copy(update={"scenario": moved}),
        origin={**record.origin, "sha256": known},
    )


def _files(scenario: Scenario) -> list[Path]:
    """The files that are looked for."""
    return [f for f in (scenario.net, scenario.routes, *scenario.additional) if f is not None]


def _file(record: Record, option: str, was: Path, given: Path | None) -> Path:
    """Where a file of a plan is."""
    expected = dict(record.origin.get("sha256") or {}).get(str(was))
    recorded_at = network_file(was) if option == "--net" else routes_file(was)
    if given is None and recorded_at.is_file() and checksum(recorded_at) == expected:
        return was
    places = [given] if given else [recorded_at, record.file.parent / recorded_at.name]
    there = [file for file in places if file.is_file()]
    for file in there:
        if checksum(file) == expected:
            return file
    what = f"{recorded_at.name!r} (sha256 {str(expected)[:12]})"
    if there:
        raise InputError(
            f"{option} {str(there[0])!r}: sha256 {checksum(there[0])[:12]}, not the {what} of "
            f"{str(record.file)!r}"
        )
    if given:
        raise InputError(f"{option}: no such file: {str(given)!r}")
    how = f"name it with {option} FILE or put it" if option.startswith("--") else "put it"
    raise InputError(f"{str(record.file)!r} needs {what}, which is not here; {how} beside it")


# Played again


def prepared_again(record: Record) -> PreparedBatch:
    """What plays a record; raises InputError when that would use what only its file names."""
    check_trust(record.plan.scenario, record.file, record.allowed)
    return prepare(record.plan)


def replayed(worker: Worker, record: Record) -> Replayed:
    """An episode once more, with all that came before it and matters to it.

    Learners first live through their earlier episodes, or are told what they knew if a trace
    stands alone; an episode of a shared simulation comes after those before it.
    """
    outcome = _played_again(worker, record).outcome
    return Replayed(outcome.row, parsed(outcome.trace) if outcome.trace else None)


def _played_again(worker: Worker, record: Record) -> Answer:
    """What its worker answers."""
    plan, run = worker.prepared.plan, record.run
    if record.alone and record.trace is not None:
        row, memory = record.row, record.trace.head["memory"]
        again = Job(run, row["agent"], int(row["seed"]), memory, record=True)
        return worker.play(again)
    if record.row["reset"] == "shared":
        first = run - run % plan.block
        return search(worker, [job(plan, i) for i in range(first, run + 1)])[-1]
    return worker.play(dataclasses.replace(job(plan, run, known(worker, run)), record=True))


def known(worker: Worker, run: int) -> Memory | None:
    """What the agents of an episode knew before it; a learner lives through its earlier ones."""
    plan, memory = worker.prepared.plan, job(worker.prepared.plan, run).memory
    step = len(plan.agents)
    learns = job(plan, run).agent in worker.prepared.cast.learners
    for earlier in range(run % step, run, step) if learns else ():
        memory = worker.play(job(plan, earlier, memory)).memory
    return memory


# Compared


def compare(record: Record, again: Replayed) -> None:
    """Raise DivergenceError at the first difference of a replay from its record."""
    name = f"run {record.run} ({record.row['agent']})"
    if again.row["outcome"] == "error" != record.row["outcome"]:
        said = f"{name} could not be played again: {again.row['error']}"
        raise DivergenceError(said, None, "", "outcome")
    frames = record.trace.frames if record.trace is not None else None
    frames_again = again.trace.frames if again.trace is not None else ()
    found = first_difference(record.row, frames, again.row, frames_again)
    if found is not None:
        place, what, step, body, quantity = found
        raise DivergenceError(f"{name} diverged at {place}: {what}", step, body, quantity)


def first_difference(
    row: Mapping[str, str],
    frames: Sequence[Mapping[str, Any]] | None,
    again: Row,
    frames_again: Sequence[Mapping[str, Any]],
) -> Difference | None:
    """Where a replay departs from the record: the timestep, the body and the quantity."""
    if frames is not None:
        for old, new in zip(frames, frames_again, strict=False):
            for difference in _frame_differences(old, new):
                return difference
        if len(frames) != len(frames_again):
            end = min(len(frames), len(frames_again))
            what = f"{len(frames)} frames were recorded, {len(frames_again)} replayed"
            return Difference("the end of the trace", what, end, quantity="frames")
    for column in COLUMNS:
        if column in NOT_REPLAYED or column not in row:  # of a version before it had the column
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
