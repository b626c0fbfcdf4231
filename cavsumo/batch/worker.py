"""A simulating process, the calling side: it gets jobs, is watched, ended and replaced.

SUMO can end its whole process (segmentation fault) or never return (endless loop). The caller
therefore waits on a pipe with a deadline, and a crash or a hang costs one row.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Mapping
from multiprocessing import Pipe
from multiprocessing.connection import Connection

from cavsumo.batch.jobs import Job, failed
from cavsumo.batch.messages import Answer, Reply, Task
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.errors import BatchError, InputError, plain
from cavsumo.model.offspring import kill_descendants
from cavsumo.model.own_folders import OwnFolder, sweep_once
from cavsumo.model.processes import by_a_lasting_thread, ending, inner_environment, last_words

STARTUP_S = 120.0  # imports, SUMO's first start and that of the ego, on a slow machine
STUCK_S = 20  # longest interruption of a message
DISMISSAL_S = 3.0  # time that a process has to end by itself
ATTEMPTS = 5  # to start a process that dies while it starts
LIFETIME = 10_000  # episodes that one process plays; SUMO leaks a little with every restart


class Worker:
    """A process with one SUMO in it, replaced when it dies; a context manager."""

    def __init__(self, prepared: PreparedBatch) -> None:
        self.prepared = prepared
        self._process: subprocess.Popen[bytes] | None = None
        self._busy = threading.Lock()
        self._played = 0
        self._group: set[Worker] = getattr(_THREAD, "group", _WORKERS)
        self.closed = False

    def __enter__(self) -> Worker:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def start(self) -> None:
        """Start the process; raises InputError when it refuses the batch."""
        with self._busy:
            self._start(strict=True)

    def play(self, job: Job) -> Answer:
        """The outcome of a job and the agents' memory after it; a crash is an outcome too.

        Raises BatchError when no process can be started any more.
        """
        begun = time.perf_counter()
        with self._busy:
            if self._played >= LIFETIME:
                self._stop()
            try:
                return self._ask(job)
            except _ProcessGone as gone:
                self._stop()
                wall = time.perf_counter() - begun
                return Answer(failed(self.prepared.plan, job, str(gone), wall), job.memory)

    def close(self) -> None:
        """End the process: by itself, or at once while another thread waits for it."""
        self.closed = True
        if self._busy.acquire(blocking=False):
            self._dismiss()
            self._busy.release()
        elif self._process is not None:
            _kill(self._process)
        with self._busy:
            self._stop()
        self._group.discard(self)

    def _start(self, *, strict: bool) -> None:
        """Start the process, unless it runs, and wait until it can play.

        Strict, an ego that cannot be started is a reason to refuse.
        """
        for _ in range(ATTEMPTS):
            if self._process is not None:
                return
            self._launch(strict)
            try:
                reply = self._receive(STARTUP_S)
            except _ProcessGone as gone:
                self._stop()
                refusal = f"the simulation cannot be started: {gone}"
            else:
                if reply.state == "ready":
                    return
                refusal = reply.reason
                break  # it refused, and would refuse again
        self._stop()
        raise InputError(refusal)

    def _ask(self, job: Job) -> Answer:
        """Play a job, by a new process if the old one has ended."""
        for _ in range(ATTEMPTS):
            try:
                self._start(strict=False)
            except InputError as error:  # it could be started when the batch began
                raise BatchError(f"no process to simulate in: {error}") from error
            try:
                self._pipe.send(Task(job=job))
            except OSError:  # it died while it waited: the job has not begun
                self._stop()
                continue
            reply = Reply("goes on")
            while reply.state == "goes on":  # each simulation has the whole deadline
                reply = self._receive(self.prepared.plan.deadline_s)
            if reply.answer is not None:
                self._played += 1
                return reply.answer
            assert reply.state == "goodbye"
            self._stop()
        raise _ProcessGone("the simulation process died again and again while it waited")

    def _launch(self, strict: bool) -> None:
        """Start the process and hand over the batch."""
        if self.closed:
            raise BatchError("the batch is over")
        self._played = 0
        sweep_once()
        self._folder = OwnFolder("worker")
        self._log = tempfile.TemporaryFile()  # noqa: SIM115  # lives as long as the process
        self._pipe, theirs = Pipe()
        _limit(self._pipe)
        fds = theirs.fileno(), self._log.fileno()
        # files that a killed process leaves are removed with this folder
        environment = inner_environment() | {"TMPDIR": self._folder.name}
        self._group.add(self)
        try:
            self._process = by_a_lasting_thread(lambda: self._started(fds, environment))
        except OSError as error:
            raise InputError(
                f"cannot start a process in {self.prepared.folder!r}: {plain(error)}"
            ) from error
        finally:
            theirs.close()  # so that its death is seen as the end of the pipe
        if self.closed:  # by another thread, which saw no process yet
            _kill(self._process)
        with contextlib.suppress(OSError):  # it died already, as _receive will find
            self._pipe.send(Task(self.prepared, strict))

    def _started(
        self, fds: tuple[int, int], environment: Mapping[str, str]
    ) -> subprocess.Popen[bytes]:
        """The started process."""
        return subprocess.Popen(
            [
                sys.executable,
                "-P",
                "-m",
                "cavsumo.batch.worker_process",
                *map(str, (*fds, os.getpid())),
            ],
            pass_fds=fds,
            cwd=self.prepared.folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            process_group=0,  # Ctrl-C is for the parent; and all of it can be killed
        )

    def _receive(self, deadline: float) -> Reply:
        """The reply of the process, or _ProcessGone when it died or took too long."""
        try:
            if self._pipe.poll(deadline):
                reply: Reply = self._pipe.recv()
                return reply
        except BlockingIOError:  # it began to answer
            raise _ProcessGone(f"stuck in its answer for {STUCK_S} s, killed") from None
        except (EOFError, OSError):
            raise _ProcessGone(self._end() + last_words(self._log.fileno())) from None
        raise _ProcessGone(f"no answer within {deadline:g} s, killed")

    def _end(self) -> str:
        """The end of the process, in words."""
        assert self._process is not None
        try:
            code = self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            return "the simulation process closed its pipe, killed"
        return f"the simulation process {ending(code)}"

    def _dismiss(self) -> None:
        """Let a process that waits for a job, and its ego, end by themselves."""
        if self._process is not None:
            self._pipe.close()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(DISMISSAL_S)

    def _stop(self) -> None:
        """End the process and its descendants."""
        if self._process is None:
            return
        _kill(self._process)
        self._process = None
        self._pipe.close()
        self._log.close()
        self._folder.close()


class _ProcessGone(Exception):
    """The process died or was killed; the message says how."""


def _limit(pipe: Connection) -> None:
    """Set a time limit on sends and on the rest of an answer, for a stopped process."""
    with socket.socket(fileno=os.dup(pipe.fileno())) as end:
        for option in (socket.SO_RCVTIMEO, socket.SO_SNDTIMEO):
            end.setsockopt(socket.SOL_SOCKET, option, struct.pack("ll", STUCK_S, 0))


def _kill(process: subprocess.Popen[bytes]) -> None:
    """Kill a process and its descendants, stopped ones too, and wait for its end.

    Its descendants first: afterwards they have another parent.
    """
    if process.poll() is None:
        process.send_signal(signal.SIGSTOP)  # so that it starts no others
        kill_descendants(process.pid)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait(10.0)


# The workers of this process, one for each thread that plays. Those of an executor of ours are a
# group, so that batches played at the same time in one process end their own workers only.

_WORKERS: set[Worker] = set()  # of threads in no group
_THREAD = threading.local()


def join_group(group: set[Worker]) -> None:
    """Have the workers of this thread in a group."""
    _THREAD.group = group


def play(prepared: PreparedBatch, job: Job) -> Answer:
    """Play a job in a process of this thread; the function that every executor calls."""
    return _own_worker(prepared).play(job)


def try_out(prepared: PreparedBatch) -> None:
    """Start this thread's process; raises InputError when it refuses the batch."""
    _own_worker(prepared).start()


def close_all(group: set[Worker] = _WORKERS) -> None:
    """End all processes of a group of workers, by default of those in none."""
    for worker in list(group):
        worker.close()


def _own_worker(prepared: PreparedBatch) -> Worker:
    """This thread's worker, a new one for another batch."""
    worker: Worker | None = getattr(_THREAD, "worker", None)
    if worker is None or worker.closed or worker.prepared.key != prepared.key:
        if worker is not None:
            worker.close()
        worker = _THREAD.worker = Worker(prepared)
    return worker
