"""Episodes in a separate process, the calling side: a pipe, a deadline, a new process after an
error.

A process has one simulation. A program that needs several at once, or must survive a crash of SUMO,
plays them here. It costs one message in each direction per step.
"""

from __future__ import annotations

import os
import subprocess
import sys
import weakref
from collections.abc import Mapping, Sequence
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any

from cavsumo.batch.prepared import PreparedBatch
from cavsumo.envs.episodes import Seen
from cavsumo.envs.settings import Roles
from cavsumo.errors import CavsumoError, SimulationError, plain
from cavsumo.model.processes import inner_environment
from cavsumo.model.snapshot import Snapshot


class RemoteEpisodes:
    """``Episodes`` in a child process, which ``reset`` starts when there is none."""

    def __init__(self, prepared: PreparedBatch, roles: Roles) -> None:
        self._prepared, self._roles = prepared, roles
        self._child: _Child | None = None

    def reset(self, seed: int) -> Seen:
        """As ``Episodes.reset``."""
        if self._child is None:
            self._child = _Child(self._prepared, self._roles)
        seen: Seen = self._ask("reset", seed)
        return seen

    def step(self, actions: Mapping[str, Sequence[float]]) -> Seen:
        """As ``Episodes.step``."""
        seen: Seen = self._ask("step", dict(actions))
        return seen

    def snapshot(self) -> Snapshot:
        """As ``Episodes.snapshot``."""
        snapshot: Snapshot = self._ask("snapshot")
        return snapshot

    def close(self) -> None:
        """End the process."""
        if self._child is not None:
            self._child.end()
            self._child = None

    def _ask(self, method: str, *arguments: Any) -> Any:
        """The answer to a call, or the error that it raised there."""
        if self._child is None:
            raise SimulationError("no episode is under way; reset first")
        try:
            answer = self._child.call(method, *arguments)
        except _ChildGone as gone:
            self.close()
            raise SimulationError(f"{gone}; reset starts another one") from None
        except BaseException:  # interrupted: the answer must not be taken for that of the next call
            self.close()
            raise
        if isinstance(answer, CavsumoError):
            raise answer
        return answer


class _ChildGone(Exception):
    """The process died or was too slow; the message says how."""


class _Child:
    """One process; ended at the latest with the object."""

    def __init__(self, prepared: PreparedBatch, roles: Roles) -> None:
        self._pipe, theirs = Pipe()
        self._deadline = prepared.plan.deadline_s
        numbers = str(theirs.fileno()), str(os.getpid())
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "cavsumo.envs.remote_process", *numbers],
                pass_fds=(theirs.fileno(),),
                cwd=prepared.folder,
                env=inner_environment(),
                stdin=subprocess.DEVNULL,
                process_group=0,
            )
        except OSError as error:
            said = f"cannot start a process to simulate in: {plain(error)}"
            raise SimulationError(said) from error
        finally:
            theirs.close()
        self.end = weakref.finalize(self, _end, self._process, self._pipe, os.getpid())
        self._pipe.send((prepared, roles))

    def call(self, method: str, *arguments: Any) -> Any:
        """Send a call and wait for its result or error."""
        try:
            self._pipe.send((method, arguments))
            if self._pipe.poll(self._deadline):
                return self._pipe.recv()
        except (EOFError, OSError):
            code = self._process.wait(5.0)
            ended = f"died of signal {-code}" if code < 0 else f"ended with status {code}"
            raise _ChildGone(f"the simulation process {ended}") from None
        raise _ChildGone(
            f"the simulation process did not answer within {self._deadline:g} s, killed"
        )


def _end(process: subprocess.Popen[bytes], pipe: Connection, owner: int) -> None:
    """Kill a process, which holds no data of value, and reap it; not from a fork."""
    pipe.close()
    if os.getpid() != owner:
        return
    process.kill()
    process.wait(10.0)
