"""The process that simulates: it plays jobs that come through a pipe until the pipe closes.

It must never outlive the process that started it. The end of the pipe tells it, between two jobs;
Linux kills it together with its parent; and an alarm ends an episode that hangs inside SUMO, where
neither Python nor the pipe is heard, on any system.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from multiprocessing.connection import Connection

from cavsumo.batch.jobs import Job
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.errors import CavsumoError
from cavsumo.model.offspring import adopt_orphans, kill_descendants
from cavsumo.model.processes import leash

IDLE_S = 60.0  # a process with nothing to do for so long goes
GOODBYE = "goodbye"  # its last message then
GOES_ON = "goes on"  # said when another simulation begins for the same job
ALARM_AFTER_S = 30.0  # how long after an episode's deadline the process ends itself


def main(pipe_fd: int, log_fd: int, parent: int) -> None:
    """Set up what the first message describes, say so, then play."""
    leash(parent)()
    adopt_orphans()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides what Ctrl-C means
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    divert_output(log_fd)
    pipe = Connection(pipe_fd)
    with contextlib.suppress(EOFError, ConnectionError):  # the parent is gone or has no more jobs
        _serve(pipe, *pipe.recv())
    sys.stderr.flush()
    kill_descendants(os.getpid())  # daemons of the ego that hide where they come from
    os._exit(0)  # taking Python and its libraries apart takes longer than an episode


def _serve(pipe: Connection, prepared: PreparedBatch, strict: bool) -> None:
    """Try out the ego and SUMO once, then play; a refusal is sent instead of None."""
    from cavsumo.batch.episode_runner import EpisodeRunner

    with contextlib.ExitStack() as stack:
        try:
            prepared.check_here()
            runner = stack.enter_context(EpisodeRunner(prepared))
            runner.try_out(strict=strict)
        except (CavsumoError, OSError) as error:
            pipe.send(str(error))
            return
        pipe.send(None)

        def alarm() -> None:
            signal.setitimer(signal.ITIMER_REAL, prepared.plan.deadline_s + ALARM_AFTER_S)

        def beat() -> None:
            alarm()
            pipe.send(GOES_ON)

        while pipe.poll(IDLE_S):
            job: Job = pipe.recv()
            alarm()
            answer = runner.play(job, beat)
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            pipe.send(answer)
        pipe.send(GOODBYE)


def divert_output(log_fd: int) -> None:
    """Send what SUMO prints to a file; what Python prints goes to the real stderr."""
    sys.stdout = sys.stderr = os.fdopen(os.dup(2), "w", buffering=1)
    os.dup2(log_fd, 1)
    os.dup2(log_fd, 2)


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
