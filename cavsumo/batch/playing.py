"""Playing checked batches one after another, for the command and the Python interface."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor

from cavsumo.batch.batch_run import BatchRun
from cavsumo.batch.ended import Ended
from cavsumo.batch.executors import opened
from cavsumo.batch.interrupts import Interrupts
from cavsumo.batch.manner import Manner, Means
from cavsumo.batch.preflight import CheckedBatch
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.batch.stopping import looks_at_rows
from cavsumo.batch.worker import try_out
from cavsumo.egos.ego_files import OutputWatch
from cavsumo.errors import CavsumoError, InputError
from cavsumo.results.inputs import TOO_LARGE
from cavsumo.results.writing import Recorder
from cavsumo.sumo.references import references

SHOWN = 3  # names of files in a message
Announce = Callable[[CheckedBatch, int], None]  # a batch, and the jobs at a time


def played(
    batches: Sequence[CheckedBatch],
    means: Means,
    manner: Manner,
    announce: Announce = lambda batch, jobs: None,
) -> tuple[list[Ended], bool]:
    """Play checked batches; returns their results, and whether the user stopped them."""
    ended: list[Ended] = []
    with opened(means) as (executor, jobs), Interrupts(manner.quiet) as interrupts:
        batches = [_tried_out(executor, batch) for batch in batches]
        for batch in batches:
            if interrupts() and ended:
                break
            ended.append(_play(batch, executor, jobs, interrupts, manner, announce))
    cut_short = len(ended) < len(batches) or any(one.cut_short for one in ended)
    return ended, interrupts() and cut_short


def _tried_out(executor: Executor, batch: CheckedBatch) -> CheckedBatch:
    """Load the batch once by its executor; files that the ego wrote meanwhile are not inputs."""
    _try_out(executor, batch.prepared)
    known = batch.prepared.checksums
    written = OutputWatch(batch.prepared.plan.scenario.ego, known).outputs()
    if known.keys().isdisjoint(written):
        return batch
    return batch.without(written)


def _try_out(executor: Executor, prepared: PreparedBatch) -> None:
    """Load the batch once."""
    try:
        executor.submit(try_out, prepared).result()
    except CavsumoError:
        raise
    except Exception as error:  # any error that prevents an executor's processes from playing
        raise InputError(f"the executor cannot play: {type(error).__name__}: {error}") from error


def _play(
    batch: CheckedBatch,
    executor: Executor,
    jobs: int,
    interrupts: Interrupts,
    manner: Manner,
    announce: Announce,
) -> Ended:
    """Play a batch, or the rest of it, into its file."""
    prepared = batch.prepared
    with Recorder(batch.output) as recorder:
        batch_run = BatchRun(prepared, recorder, executor, jobs, interrupts, manner.quiet)
        if batch.recorded is None:
            batch_run.begin(batch.manifest, overwrite=manner.overwrite)
        else:
            batch_run.resume({**batch.recorded, "plan": batch.manifest["plan"]})
        if not manner.quiet:
            announce(batch, jobs)
        too_large = (f"{str(file)!r} {TOO_LARGE}" for file in batch_run.left_out)
        for said in (*too_large, *_apart(prepared)):
            print(f"cavsumo: {said}", file=sys.stderr)
        _carry_out(batch_run, manner)
    return Ended(
        batch.name,
        batch.output,
        batch_run.tally,
        recorder.traces,
        prepared.plan.reference,
        sequential=looks_at_rows(prepared.plan),
        cut_short=batch_run.cut_short or batch_run.status == "interrupted",
        searches=batch_run.searches,
        estimates=batch_run.estimates,
        promises={member.label: member.promise for member in prepared.cast},
    )


def _apart(prepared: PreparedBatch) -> Iterator[str]:
    """Sentences about files that SUMO reads and that are not kept."""
    scenario = prepared.plan.scenario
    routes = [] if scenario.routes_file is None else [scenario.routes_file]
    for file in (*routes, *scenario.additional_files):
        if names := references(file):
            them = ", ".join(map(repr, names[:SHOWN])) + (", ..." if names[SHOWN:] else "")
            yield (
                f"{file.name!r} has SUMO read {them}, which the results do not keep: a replay "
                "elsewhere needs both beside them"
            )


def _carry_out(batch_run: BatchRun, manner: Manner) -> None:
    """Play or retry, and complete the manifest in any case."""
    try:
        if manner.retry_errors:
            batch_run.retry()
        if manner.resume or not manner.retry_errors:
            batch_run.play()
    except KeyboardInterrupt:  # twice: running episodes are given up
        batch_run.status = "interrupted"
    finally:
        batch_run.end()
