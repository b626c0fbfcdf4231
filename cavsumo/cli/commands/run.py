"""``cavsumo run``: one batch or several, from the start or from where they are."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

from cavsumo.batch import sentences
from cavsumo.batch.batch_run import BatchRun
from cavsumo.batch.ended import Ended
from cavsumo.batch.executors import Means, opened
from cavsumo.batch.interrupts import Interrupts
from cavsumo.batch.preflight import CheckedBatch, Manner, checked
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.batch.stopping import looks_at_rows
from cavsumo.batch.summary import summarise
from cavsumo.batch.tally import found_by
from cavsumo.batch.worker import try_out
from cavsumo.egos import make_ego
from cavsumo.egos.ego_files import OutputWatch
from cavsumo.errors import CavsumoError, Exit, InputError
from cavsumo.model.study import Part
from cavsumo.results.writing import Recorder


def run(settings: Mapping[str, Any], output: Path, means: Means, manner: Manner) -> int:
    """Play a batch; everything is checked before anything is written."""
    return run_study([Part("", dict(settings))], output, means, manner)


def run_study(parts: Sequence[Part], output: Path, means: Means, manner: Manner) -> int:
    """Play one batch after another; all are checked before anything is written."""
    ended, interrupted = played(checked(parts, output, manner), means, manner)
    status = exit_status(ended, interrupted, manner.exit_zero)
    if not manner.quiet:
        summarise(ended)
        if status == Exit.VIOLATED:
            print(f"cavsumo: exit status {status:d}: {_reason(ended)}", file=sys.stderr)
    return status


def played(
    batches: Sequence[CheckedBatch], means: Means, manner: Manner
) -> tuple[list[Ended], bool]:
    """Play batches that were checked; what they came to, and whether that was cut short."""
    ended: list[Ended] = []
    with opened(means) as (executor, jobs), Interrupts(manner.quiet) as interrupts:
        batches = [_tried_out(executor, batch) for batch in batches]
        for batch in batches:
            if interrupts() and ended:
                break
            ended.append(_play(batch, executor, jobs, interrupts, manner))
    cut_short = len(ended) < len(batches) or any(one.cut_short for one in ended)
    return ended, interrupts() and cut_short


def _tried_out(executor: Executor, batch: CheckedBatch) -> CheckedBatch:
    """Have the batch loaded once, where it will be played; what the ego wrote is no input."""
    _try_out(executor, batch.prepared)
    known = batch.prepared.checksums
    written = OutputWatch(batch.prepared.plan.scenario.ego, known).outputs()
    if known.keys().isdisjoint(written):
        return batch
    return batch.without(written)


def _try_out(executor: Executor, prepared: PreparedBatch) -> None:
    """Have the batch loaded once."""
    try:
        executor.submit(try_out, prepared).result()
    except CavsumoError:
        raise
    except Exception as error:  # whatever keeps an executor's processes from playing
        raise InputError(f"the executor cannot play: {type(error).__name__}: {error}") from error


def _play(
    batch: CheckedBatch, executor: Executor, jobs: int, interrupts: Interrupts, manner: Manner
) -> Ended:
    """Play a batch into its file, or what is left of it."""
    prepared = batch.prepared
    with Recorder(batch.output) as recorder:
        batch_run = BatchRun(prepared, recorder, executor, jobs, interrupts, manner.quiet)
        if batch.recorded is None:
            batch_run.begin(batch.manifest, overwrite=manner.overwrite)
        else:
            batch_run.resume({**batch.recorded, "plan": batch.manifest["plan"]})
        if not manner.quiet:
            print(_first_line(batch, jobs), file=sys.stderr)
        _carry_out(batch_run, manner)
    return Ended(
        batch.name,
        batch.output,
        batch_run.tally,
        recorder.traces,
        prepared.plan.reference,
        sequential=looks_at_rows(prepared.plan),
        shared=prepared.plan.reset == "shared",
        cut_short=batch_run.cut_short or batch_run.status == "interrupted",
        promises={member.label: member.promise for member in prepared.cast},
    )


def _carry_out(batch_run: BatchRun, manner: Manner) -> None:
    """Do what was asked for, and complete the manifest whatever happens."""
    try:
        if manner.retry_errors:
            batch_run.retry()
        if manner.resume or not manner.retry_errors:
            batch_run.play()
    except KeyboardInterrupt:  # twice: what runs is given up
        batch_run.status = "interrupted"
    finally:
        batch_run.end()


def exit_status(ended: Sequence[Ended], interrupted: bool, exit_zero: bool) -> int:
    """130 interrupted, 3 an episode could not be run, 1 the ego violated an assertion, else 0.

    It is 1 whether that was preventable or not: what the ego did is known, what another driver
    would have done is a judgement.
    """
    if interrupted:
        return Exit.INTERRUPTED
    found = [one.tally.all for one in ended]
    if any(one.errors for one in found):
        return Exit.NOT_RUN
    violated = any(one.failures for one in found)
    return Exit.VIOLATED if violated and not exit_zero else Exit.OK


def _reason(ended: Sequence[Ended]) -> str:
    """What exit status 1 stands for, the preventable failures first."""
    judged = all(one.judged for one in ended)
    return sentences.exit_reason(found_by(one.tally.all for one in ended), judged)


def _first_line(batch: CheckedBatch, jobs: int) -> str:
    """What was chosen, for the user to see."""
    prepared = batch.prepared
    plan, scenario, route = prepared.plan, prepared.plan.scenario, prepared.site.route
    ego = make_ego(scenario.ego, scenario.ego_params)
    attributes = " ".join(f"{k}={v}" for k, v in getattr(ego, "attributes", {}).items())
    driver = f"{scenario.ego} ({attributes})" if attributes else scenario.ego
    where = f" junction {route.junction}" if route.junction else ""
    routes = scenario.routes.name if scenario.routes else "none"
    if scenario.traffic is not None:
        routes = "{:g},{:g} per minute and km".format(*scenario.traffic)
    shard = f", shard {plan.shard}" if plan.shard else ""
    bodies = "buses" if scenario.kind == "bus" else f"{scenario.kind}s"
    at_a_time = f", {jobs} at a time" if jobs > 1 else ""
    part = f"{batch.name}: " if batch.name else ""
    return (
        f"cavsumo: {part}agent {' '.join(plan.agents)}, {scenario.testers} {bodies}, "
        f"ego {driver}, network {scenario.name}{where}, traffic {routes}, "
        f"seed {plan.seed}, {plan.runs} episodes an agent{shard}{at_a_time}"
    )
