"""Commands and workers in this process: same rows, texts and refusals, without a process's start.

A crash or a hang of SUMO or an ego then ends the tests, and what an ego prints is not diverted:
tests of such things, and of processes themselves, stand in tests/process and use real ones.
"""

from __future__ import annotations

import contextlib
import io
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from cavsumo.batch import worker as workers
from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import Job
from cavsumo.batch.messages import Answer
from cavsumo.batch.worker import Worker
from cavsumo.cli import main
from cavsumo.errors import BatchError, CavsumoError, InputError, plain

_RUNNERS: dict[Worker, EpisodeRunner] = {}
_ONE_SUMO = threading.RLock()  # for all threads of this process


@contextmanager
def played_here() -> Iterator[None]:
    """Have whatever would be played in processes of their own played in this one."""
    with pytest.MonkeyPatch.context() as patch:
        for name, method in (("start", _start), ("play", _play), ("close", _close)):
            patch.setattr(Worker, name, method)
        try:
            yield
        finally:
            workers.close_all()


def _start(self: Worker) -> None:
    """Set the batch up and try it out, as a process does when it starts."""
    with _ONE_SUMO:
        if self in _RUNNERS:
            return
        if self.closed:
            raise BatchError("the batch is over")
        prepared = self.prepared
        try:
            prepared.check_here()
            runner = EpisodeRunner(prepared)
            _RUNNERS[self] = runner
            self._group.add(self)
            runner.try_out()
        except (CavsumoError, OSError) as error:
            _close(self)
            raise InputError(plain(error)) from error


def _play(self: Worker, job: Job) -> Answer:
    """The outcome of a job and the agents' memory after it."""
    with _ONE_SUMO:
        self.start()
        return _RUNNERS[self].play(job)


def _close(self: Worker) -> None:
    """End SUMO and the ego."""
    with _ONE_SUMO:
        self.closed = True
        self._group.discard(self)
        if runner := _RUNNERS.pop(self, None):
            runner.__exit__(None, None, None)


@dataclass(frozen=True)
class Done:
    """A command that has ended; the names are those of ``subprocess.CompletedProcess``."""

    returncode: int
    stdout: str
    stderr: str


def cavsumo(folder: Path, *words: str) -> Done:
    """The command line in a folder, in this process; modules it imports from there go again."""
    out, err, path, known = io.StringIO(), io.StringIO(), list(sys.path), set(sys.modules)
    with (
        contextlib.chdir(folder),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            status = main(words)
        except SystemExit as ended:  # as argparse ends --help and --version
            status = int(ended.code or 0)
        finally:
            sys.path[:] = path
            for name in set(sys.modules) - known:
                file = getattr(sys.modules[name], "__file__", None)
                if file is not None and Path(file).is_relative_to(folder):
                    del sys.modules[name]
    return Done(status, out.getvalue(), err.getvalue())
