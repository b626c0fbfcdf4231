"""A simulating process, the called side: it plays jobs from a pipe until the pipe closes.

It must never outlive the process that started it. Between two jobs it sees the end of the pipe;
Linux kills it together with its parent; and on any system an alarm ends an episode that hangs
inside SUMO, where Python does not run.
"""

from __future__ import annotations

import contextlib
import gc
import os
import signal
import sys
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING

from cavsumo.batch.messages import Reply, Task
from cavsumo.errors import CavsumoError, plain
from cavsumo.model.fork_child import ALARM_AFTER_S, places
from cavsumo.model.forks import can_fork
from cavsumo.model.objects import take
from cavsumo.model.offspring import adopt_orphans, kill_descendants
from cavsumo.model.processes import end_with_parent

if TYPE_CHECKING:
    from cavsumo.batch.episode_server import EpisodeServer

IDLE_S = 60.0  # an idle process ends after this time


def main(pipe_fd: int, log_fd: int, parent: int) -> None:
    """Prepare for the batch of the first task, reply, then play."""
    end_with_parent(parent)()
    adopt_orphans()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides what Ctrl-C means
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    divert_output(log_fd)
    pipe = Connection(pipe_fd)
    with contextlib.suppress(EOFError, ConnectionError):  # the parent is gone or has no more jobs
        _serve(pipe, pipe.recv(), log_fd)
    sys.stderr.flush()
    kill_descendants(os.getpid())  # daemons of the ego that have left their process tree
    os._exit(0)  # an orderly end of Python and its libraries takes longer than an episode


def _serve(pipe: Connection, first: Task, log: int) -> None:
    """Try out the ego and SUMO once, then play, unless that is refused."""
    from cavsumo.batch.episode_runner import EpisodeRunner
    from cavsumo.batch.episode_server import EpisodeServer

    own = frozenset(places() if can_fork() else ())
    prepared = first.batch
    assert prepared is not None
    with contextlib.ExitStack() as stack:
        take(prepared.objects)
        try:
            prepared.check_here()
            runner = stack.enter_context(EpisodeRunner(prepared))
            runner.try_out(strict=first.strict)
        except (CavsumoError, OSError) as error:
            pipe.send(Reply("refused", plain(error)))
            return
        gc.collect()
        gc.freeze()  # what is there now stays: it need not be looked through again and again
        pipe.send(Reply("ready"))
        deadline = prepared.plan.deadline_s
        streams = sys.stderr.fileno(), log
        _play(pipe, EpisodeServer(runner, deadline, streams, own), deadline)


def _play(pipe: Connection, server: EpisodeServer, deadline: float) -> None:
    """Play jobs until the process is idle for long.

    ``deadline``: of each simulation [s].
    """

    def alarm() -> None:
        signal.setitimer(signal.ITIMER_REAL, deadline + ALARM_AFTER_S)

    def beat() -> None:
        alarm()
        pipe.send(Reply("goes on"))

    while pipe.poll(IDLE_S):
        task: Task = pipe.recv()
        assert task.job is not None
        alarm()
        answer = server.play(task.job, beat)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        pipe.send(Reply("played", answer=answer))
    pipe.send(Reply("goodbye"))


def divert_output(log_fd: int) -> None:
    """Send SUMO's output to a file; Python's output goes to the real stderr."""
    sys.stdout = sys.stderr = os.fdopen(os.dup(2), "w", buffering=1)
    os.dup2(log_fd, 1)
    os.dup2(log_fd, 2)


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
