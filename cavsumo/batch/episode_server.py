"""Episodes in forks of a simulating process, in which SUMO has been started once for all of them.

On a large network the start of SUMO costs far more than an episode. From its second job on, a
process therefore keeps a simulation that stands by, and each job is played in a fork, which makes
it the job's own (``sumo.connection``). The answers are the same as without: the first job, which
was played in a simulation that was started for it, is played once more in a fork, and every number
of its row and its snapshots is compared.

A fork that crashes or hangs costs one row, and the process goes on. One that ends otherwise, or by
SUMO's own decision (SIGABRT: an error in a route file, for instance), is played again as without
forks, which gives that error its words.
"""

from __future__ import annotations

import dataclasses
import gc
import os
import selectors
import signal
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial

from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import Job, failed
from cavsumo.batch.messages import Answer
from cavsumo.errors import BranchError, SimulationError
from cavsumo.model.fork_child import ALARM_AFTER_S, CHUNK, places
from cavsumo.model.forks import Fork, can_fork, cost_of_fork
from cavsumo.model.offspring import children, kill_strays
from cavsumo.model.processes import ending, last_words

LARGE = 1000  # lanes, junctions included; to start SUMO with them costs more than several forks

Beat = Callable[[], None]


class EpisodeServer:
    """Plays the jobs of a process, in forks where that pays.

    Args:
        runner: with a simulation that has been started.
        deadline: of each simulation [s].
        streams: the descriptors to which this process prints, for Python's and for SUMO's output.
        own: all that it had before any code of users ran in it.
    """

    def __init__(
        self,
        runner: EpisodeRunner,
        deadline: float,
        streams: tuple[int, int],
        own: Collection[int],
    ) -> None:
        self.runner, self._deadline, self._own = runner, deadline, own
        self._stderr, self._log = streams
        self._small = runner.setup.world.lanes < LARGE
        self._first: tuple[Job, Answer] | None = None  # to be compared before the second job
        self._forks: bool | None = None  # whether jobs are played in forks; None until compared
        self._stands_by = False

    def play(self, job: Job, beat: Beat) -> Answer:
        """The answer of a job; ``beat`` is called when more time begins for it."""
        note = ""
        if self._first is not None:
            note = self._compared(*self._first, beat)
            self._first = None
        if self._forks and not self._unsuited():
            return self._forked(job, beat)
        compared = self._forks is None and not self._small
        answer = self._here(job, beat, digest=compared)
        if compared:
            self._first = job, answer
        return dataclasses.replace(answer, digest="", note=note)

    def _here(self, job: Job, beat: Beat, *, digest: bool = False) -> Answer:
        """The answer of a job that is played without a fork."""
        self._stands_by = False
        return self.runner.play(job, beat, digest=digest)

    def _compared(self, job: Job, answer: Answer, beat: Beat) -> str:
        """Decide whether jobs are played in forks; the reason if they are not."""
        reason = self._unsuited()
        if not reason:
            beat()
            try:
                self._stand_by()
            except SimulationError as error:
                reason = str(error)
            else:
                again = self._forked(job, beat, compared=True)
                reason = "" if same(answer, again) else f"run {job.run} is another one in a fork"
        self._forks = not reason
        return reason

    def _unsuited(self) -> str:
        """The reason why a job cannot be played in a fork, empty if it can."""
        setup = self.runner.setup
        if setup.ego.outside:
            return "the ego is in another process"
        if not can_fork():
            return "there are threads besides the first, or the system has no forks"
        if any(place is None and n not in self._own for n, place in places().items()):
            return "agents, ego or assertions hold a connection or a file open"
        return setup.world.simulations.stand_by_refusal

    def _stand_by(self) -> None:
        """Start a simulation for forks, unless there is one."""
        if not self._stands_by:
            self.runner.setup.world.stand_by()
            self._stands_by = True
            self._children = frozenset(children(os.getpid()))
            cost_of_fork()  # which forks would measure anew
            gc.collect()
            gc.freeze()  # so that a fork's collections leave the pages shared

    def _forked(self, job: Job, beat: Beat, *, compared: bool = False) -> Answer:
        """The answer of a job that is played in a fork, and a failure in another one.

        To judge a failure takes the episode at its start once more, for which a second fork is kept
        waiting (``checkpoints``); that would cost most episodes more than it saves the others.

        ``compared``: with a checksum, and what users' code prints is not printed once more.
        """
        first = {"judge": False, "digest": compared}
        answer = self._in_fork(job, beat, first, [] if compared else [self._stderr])
        if answer.judged:
            return answer
        return self._in_fork(job, beat, {"judge": True, "digest": compared}, [])

    def _in_fork(
        self, job: Job, beat: Beat, how: Mapping[str, bool], kept: Sequence[int]
    ) -> Answer:
        """The answer of one fork.

        Args:
            how: further arguments of ``EpisodeRunner.play``.
            kept: descriptors that it keeps.
        """
        begun = time.perf_counter()
        source, sink = os.pipe()
        try:
            beat()
            self._stand_by()
            os.ftruncate(self._log, 0)
            os.lseek(self._log, 0, os.SEEK_SET)
            work = partial(_played, self.runner, job, sink, self._deadline, how)
            fork = Fork(work, self._deadline, [sink, *kept])
        except (BranchError, SimulationError):  # no process; or SUMO would not start
            os.close(source)
            return self._here(job, beat)
        finally:
            os.close(sink)
        try:
            said = self._awaited(fork, source, beat)
            return fork.result() if said is None else self._failed(job, said, begun)
        except BranchError:
            if fork.code is None or fork.code >= 0 or fork.code == -signal.SIGABRT:
                return self._here(job, beat)
            said = f"the simulation process {ending(fork.code)}{last_words(self._log)}"
            return self._failed(job, said, begun)
        finally:
            os.close(source)

    def _failed(self, job: Job, said: str, begun: float) -> Answer:
        """The answer of a job whose fork has died, after which nothing of the fork is left."""
        kill_strays(self._children)
        wall = time.perf_counter() - begun
        return Answer(failed(self.runner.plan, job, said, wall), job.memory)

    def _awaited(self, fork: Fork[Answer], source: int, beat: Beat) -> str | None:
        """Wait until a fork has sent all that it will send; a sentence if it takes too long.

        ``source``: where it says that another simulation begins, which has the whole time.
        """
        ends = time.monotonic() + self._deadline
        with selectors.DefaultSelector() as selector:
            for descriptor in (fork.source, source):
                selector.register(descriptor, selectors.EVENT_READ)
            while (left := ends - time.monotonic()) > 0.0:
                ready = {key.fd for key, _ in selector.select(min(left, self._deadline / 2))}
                if fork.source in ready and fork.receive():
                    return None
                if not ready:
                    beat()  # who waits for this process shall know that it is well
                elif source in ready:
                    if os.read(source, CHUNK):
                        ends = time.monotonic() + self._deadline
                        beat()
                    else:
                        selector.unregister(source)
        fork.kill()
        return f"no answer within {self._deadline:g} s, killed"


def _played(
    runner: EpisodeRunner, job: Job, sink: int, deadline: float, how: Mapping[str, bool]
) -> Answer:
    """The answer of a job, in a fork, which says when another simulation begins."""

    def beat() -> None:
        signal.setitimer(signal.ITIMER_REAL, deadline + ALARM_AFTER_S)
        os.write(sink, b".")

    return runner.play(job, beat, **how)


def same(first: Answer, second: Answer) -> bool:
    """Whether two answers are the same but for the real time, to the last digit."""
    told = [
        (repr({**a.outcome.row, "wall_s": None}), a.outcome.trace, a.outcome.ego_log, a.digest)
        for a in (first, second)
    ]
    return told[0] == told[1] and first.memory == second.memory
