"""Playing a recorded episode back: what its testers did and who departed, without its agent."""

from __future__ import annotations

import dataclasses
from typing import Any

from cavsumo.agents.casting import tester_bodies
from cavsumo.agents.recorded import Recorded, action_between
from cavsumo.batch.jobs import Job
from cavsumo.batch.replay import Record, Replayed
from cavsumo.batch.worker import Worker
from cavsumo.errors import InputError, ResultsError
from cavsumo.model.bodies import Action
from cavsumo.model.scenario import BatchPlan
from cavsumo.results.present import input_files
from cavsumo.results.traces import Trace, trace_of

# Columns of which the agents and the reruns decide, so that a playback does not reproduce them.
NOT_PLAYED_BACK = frozenset(
    {"agent", "forecast", "forecast_value", "grade"}
    | {"avoidable", "avoidable_ideal", "reference", "last_chance_s", "margin_s", "avoidable_note"}
)
AGAIN = "playback"  # label of the agent in a plan that is played back


def recording_of(record: Record, trace: Trace) -> Recorded:
    """The data for playing an episode back, from its trace; raises ResultsError if damaged.

    A trace of format 1 holds no actions: those that lead from frame to frame are computed, which
    is not always exact, and the starts are drawn again.
    """
    if not trace.has_recording:
        return Recorded(int(trace.row["seed"]), _between_frames(trace, record.plan))
    testers = record.plan.scenario.testers
    try:
        found = trace.recording()
    except ResultsError as error:
        raise ResultsError(f"{str(record.file)!r}: trace of run {record.run}: {error}") from error
    if len(found.starts) != testers:
        raise ResultsError(
            f"{str(record.file)!r}: trace of run {record.run}: {len(found.starts)} starts of "
            f"{testers} testers"
        )
    return found


def _between_frames(trace: Trace, plan: BatchPlan) -> list[list[Action]]:
    """The actions that lead from frame to frame, by inverse kinematics."""
    bodies, dt = tester_bodies(plan.scenario), plan.scenario.step_length
    return [
        [
            Action(
                *action_between(
                    body.kind, before["testers"][body.id], after["testers"][body.id], dt
                )
            )
            for body in bodies
        ]
        for before, after in zip(trace.frames, trace.frames[1:], strict=False)
    ]


def for_playback(record: Record) -> Record:
    """A record as it is played back: without its agent's files, and without a demand if who
    departed is recorded.

    Raises InputError when it holds no actions.
    """
    recorded, scenario = _recording(record), record.plan.scenario
    changed: dict[str, Any] = {"approaches": tuple(recorded.approaches)}
    if recorded.departures is not None:
        changed |= {"routes": None, "traffic": None}
    plan = record.plan.model_copy(
        update={
            "scenario": scenario.model_copy(update=changed),
            "agents": (f"{AGAIN}=recorded",),
            "params": {},
            "known": None,
            "reference": "none",
        }
    )
    unused = input_files(record.plan).keys() - input_files(plan).keys()
    unused |= {"traffic"} if recorded.departures is not None else set()
    sums = dict(record.origin.get("sha256") or {})
    kept = {name: sha for name, sha in sums.items() if name not in unused}
    return dataclasses.replace(record, plan=plan, origin={**record.origin, "sha256": kept})


def played_back(worker: Worker, record: Record) -> Replayed:
    """An episode played back by a worker of its plan; the record is that of ``for_playback``."""
    outcome = worker.play(playback_job(record)).outcome
    return Replayed(outcome.row, trace_of(outcome))


def playback_job(record: Record) -> Job:
    """The job that plays a record back; the record is that of ``for_playback``."""
    script = record.plan.scenario.script
    ends = script is not None and script.board is not None and bool(script.board.stops)
    recorded = dataclasses.replace(_recording(record), stops=ends)
    return Job(record.run, AGAIN, recorded.seed, record=True, recorded=recorded)


def _recording(record: Record) -> Recorded:
    """The recording of a record; raises InputError when it holds no actions."""
    run, trace = record.run, record.trace
    if trace is None:
        raise InputError(f"--playback: no trace was kept of run {run}")
    if not trace.has_recording:
        raise InputError(f"--playback: the trace of run {run} is of format 1, without actions")
    return recording_of(record, trace)
