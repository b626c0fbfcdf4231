"""``cavsumo replay``: a recorded episode once more, compared frame by frame, bit for bit."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

from cavsumo.errors import Exit
from cavsumo.jobs import job, learners
from cavsumo.outcomes import Outcome
from cavsumo.replays import first_difference, recorded_frames, recorded_plan, recorded_row
from cavsumo.setting import Setting, changes, manifest, prepare
from cavsumo.worker import Worker, search


def replay(results: Path, run_number: int) -> int:
    """Play a row again; say where it differs, if it does."""
    plan, recorded = recorded_plan(results)
    row = recorded_row(results, run_number)
    frames = recorded_frames(results, row)
    setting = prepare(plan)
    for change in changes(recorded, manifest(setting)):
        print(f"cavsumo: {change}", file=sys.stderr)
    again = replayed(setting, run_number, shared=row["reset"] == "shared")
    difference = first_difference(row, frames, again.row, again.frames)
    if difference is not None:
        print(f"run {run_number}: diverged: {difference}")
        return Exit.VIOLATED
    compared = f"{len(frames)} frames" if frames is not None else "its row (no trace was kept)"
    print(f"run {run_number} ({row['agent']}): {row['outcome']}, {compared}: the same")
    return Exit.OK


def replayed(setting: Setting, run_number: int, *, shared: bool = False) -> Outcome:
    """An episode once more, with all that came before it and matters to it.

    Learners first live through their earlier episodes; ``shared``, so does the simulation.
    """
    plan, memory = setting.plan, None
    step = len(plan.agents)
    learns = job(plan, run_number).agent in learners(plan)
    with Worker(setting) as worker:
        if shared:
            first = run_number - run_number % plan.block
            return search(worker, [job(plan, run) for run in range(first, run_number + 1)])[-1][0]
        for earlier in range(run_number % step, run_number, step) if learns else ():
            _, memory = worker.play(job(plan, earlier, memory))
        outcome, _ = worker.play(dataclasses.replace(job(plan, run_number, memory), record=True))
    return outcome
