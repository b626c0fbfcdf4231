"""Many episodes, each in a process that may die: a crash or a hang costs one row, never more.

SUMO can end the whole process (segmentation fault) or never come back (endless loop), so the
parent only waits on a pipe with a deadline, and replaces a worker that is gone.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from cavsumo.errors import CavsumoError, InputError
from cavsumo.jobs import Job, failed, job
from cavsumo.outcomes import Outcome
from cavsumo.scenario import BatchPlan
from cavsumo.site import Site

STARTUP_S = 120.0  # imports and SUMO's first start, on a slow machine
CONTEXT = multiprocessing.get_context("spawn")


def run_batch(plan: BatchPlan, worker: Worker) -> Iterator[tuple[Outcome, Any]]:
    """The outcomes of a batch in run order, with what the agents know after each.

    Learning agents take their memory along from one of their episodes to the next, through the
    parent, so that a worker's death loses one episode and not the training.
    """
    memories: dict[str, Any] = {}
    for run in range(plan.runs * len(plan.agents)):
        name = plan.agents[run % len(plan.agents)]
        outcome, memories[name] = worker.play(job(plan, run, memories.get(name)))
        yield outcome, memories[name]


class Worker:
    """A process with one SUMO in it, replaced when it dies; a context manager.

    Raises InputError on entering when the plan cannot be set up at all.
    """

    def __init__(self, plan: BatchPlan, site: Site) -> None:
        self.plan, self.site = plan, site
        self._process: Any = None

    def __enter__(self) -> Worker:
        self._log = tempfile.NamedTemporaryFile(prefix="cavsumo-worker-", suffix=".log")
        self._start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop()
        self._log.close()

    def play(self, job: Job) -> tuple[Outcome, Any]:
        """The outcome of a job and the agents' memory after it; never raises for its crash."""
        begun = time.perf_counter()
        try:
            if self._process is None:
                self._start()
            self._send(job)
            answer: tuple[Outcome, Any] = self._receive(self.plan.deadline_s)
            return answer
        except _WorkerGone as gone:
            self._stop()
            wall = time.perf_counter() - begun
            return failed(self.plan, job, str(gone), wall), job.memory

    def _start(self) -> None:
        """Start the process and wait until it has rehearsed."""
        self._pipe, theirs = CONTEXT.Pipe()
        self._process = CONTEXT.Process(
            target=_serve, args=(theirs, self.plan, self.site, self._log.name), daemon=True
        )
        self._process.start()
        theirs.close()  # so that its death is seen as the end of the pipe
        try:
            refusal = self._receive(STARTUP_S)
        except _WorkerGone as gone:
            self._stop()
            raise InputError(f"SUMO cannot load this scenario: {gone}") from gone
        if refusal is not None:
            self._stop()
            raise InputError(refusal)

    def _send(self, job: Job) -> None:
        """Hand over a job; _WorkerGone when there is nobody to take it."""
        try:
            self._pipe.send(job)
        except OSError:
            self._process.join(5.0)
            raise _WorkerGone(_end_of(self._process.exitcode)) from None

    def _receive(self, deadline: float) -> Any:
        """What the process sends, or _WorkerGone when it died or took too long."""
        try:
            if self._pipe.poll(deadline):
                return self._pipe.recv()
        except (EOFError, OSError):
            self._process.join(5.0)
            raise _WorkerGone(_end_of(self._process.exitcode) + self._last_words()) from None
        raise _WorkerGone(f"no answer within {deadline:g} s, killed")

    def _last_words(self) -> str:
        """The last line that the process printed below Python."""
        text = Path(self._log.name).read_text(encoding="utf-8", errors="replace")
        lines = [line.strip() for line in text.splitlines() if line.strip()]
        return f" ({lines[-1]})" if lines else ""

    def _stop(self) -> None:
        """End the process, by force if it does not go by itself."""
        if self._process is None:
            return
        self._pipe.close()
        self._process.join(2.0)
        if self._process.is_alive():
            self._process.kill()
            self._process.join(10.0)
        self._process = None


class _WorkerGone(Exception):
    """The worker died or was killed; the message says how."""


def _end_of(exitcode: int | None) -> str:
    """How a process ended, in words."""
    if exitcode is not None and exitcode < 0:
        return f"the simulation process died of {signal.Signals(-exitcode).name}"
    return f"the simulation process ended with status {exitcode}"


def _serve(pipe: Connection, plan: BatchPlan, site: Site, log: str) -> None:
    """The worker: rehearse once, then play jobs until the pipe closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides what Ctrl-C means
    _divert_output(log)
    from cavsumo.theatre import Theatre

    try:
        theatre = Theatre(plan, site)
        theatre.rehearse()
    except CavsumoError as error:
        pipe.send(str(error))
        return
    pipe.send(None)
    with theatre:
        while True:
            try:
                job = pipe.recv()
            except EOFError:
                return
            pipe.send(theatre.play(job))


def _divert_output(log: str) -> None:
    """Send what SUMO prints to a file; what Python prints goes to the real stderr."""
    sys.stdout = sys.stderr = os.fdopen(os.dup(2), "w", buffering=1)
    sink = os.open(log, os.O_WRONLY | os.O_TRUNC)
    os.dup2(sink, 1)
    os.dup2(sink, 2)
