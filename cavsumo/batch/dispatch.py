"""Many episodes by any executor, with their outcomes in the order of their numbers.

The result does not depend on the order in which episodes finish, nor on their place. Episodes are
independent of each other, except those of a learning agent, whose memory goes from one of its
episodes to the next: they are played in sequence while the episodes of others fill the executor.
Its final knowledge can then be played in parallel (``learn=false``).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    wait,
)
from dataclasses import dataclass
from typing import Any

from cavsumo.batch.choosers import Chooser
from cavsumo.batch.jobs import Job, Memory, failed, job
from cavsumo.batch.messages import Answer
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.batch.worker import play
from cavsumo.errors import BatchError, CavsumoError

POLL_S = 0.2  # interval of checks whether to stop, while no episode finishes


def run_batch(
    prepared: PreparedBatch,
    executor: Executor,
    todo: Iterable[int],
    *,
    memories: Mapping[str, Memory] | None = None,
    searches: Mapping[str, Chooser] | None = None,
    ahead: int = 16,
    stopped: Callable[[], bool] = lambda: False,
) -> Iterator[Answer]:
    """The answers of a batch in the order of ``todo``.

    Closing the iterator gives up the answers that it has not yet returned.

    Args:
        executor: plays jobs by ``cavsumo.batch.worker.play``, in threads or in processes anywhere.
        todo: numbers of episodes, ascending.
        memories: the knowledge of learning agents, by name.
        searches: the choosers of agents that are told what to play, likewise; they are told of
            every episode.
        ahead: number of episodes that run or wait for their turn.
        stopped: called all the time; once true, running episodes are finished and no more are
            begun.
    """
    line = _Line(prepared, executor, todo, dict(memories or {}), searches or {})
    try:
        while True:
            if stopped():
                line.call_off()
            else:
                line.join(ahead)
            if not line.entries:
                return
            line.advance()
            yield from line.ready()
    finally:
        line.call_off()


@dataclass
class _Entry:
    """An episode, from the request to the answer."""

    run: int
    agent: str
    future: Future[Answer] | None = None
    answer: Answer | None = None


class _Line:
    """Episodes in the order of their answers; each is submitted as soon as possible."""

    def __init__(
        self,
        prepared: PreparedBatch,
        executor: Executor,
        todo: Iterable[int],
        memories: dict[str, Any],
        searches: Mapping[str, Chooser],
    ) -> None:
        self.prepared, self.executor, self.memories = prepared, executor, memories
        self.searches = searches
        agents = tuple(prepared.plan.cast)
        self._coming = (_Entry(run, agents[run % len(agents)]) for run in todo)
        self.entries: deque[_Entry] = deque()
        self._learners = prepared.cast.learners

    def join(self, ahead: int) -> None:
        """Take up episodes until so many are in line, and submit those that can start."""
        while len(self.entries) < ahead and (entry := next(self._coming, None)) is not None:
            self.entries.append(entry)
        learning = set()
        for entry in self.entries:
            if entry.answer is None and entry.agent in self._learners:
                if entry.agent in learning:
                    continue  # it can start when it has the memory of the episode before
                learning.add(entry.agent)
            if entry.future is None and self._known(entry):
                self._submit(entry)

    def advance(self) -> None:
        """Wait a short time for an episode to finish."""
        waiting = [e for e in self.entries if e.future is not None and e.answer is None]
        wait([e.future for e in waiting if e.future], POLL_S, return_when=FIRST_COMPLETED)
        for entry in waiting:
            if entry.future is not None and entry.future.done():
                entry.answer = self._answer(entry, entry.future)
                if entry.agent in self._learners:
                    self.memories[entry.agent] = entry.answer.memory
                if entry.agent in self.searches:
                    self.searches[entry.agent].told(entry.answer.outcome.row)

    def ready(self) -> Iterator[Answer]:
        """The entries to return: all that are finished before the first that is not."""
        while self.entries and (answer := self.entries[0].answer) is not None:
            self.entries.popleft()
            yield answer

    def call_off(self) -> None:
        """Drop the entries that have not started, and all entries after them."""
        for place, entry in enumerate(self.entries):
            if entry.answer is None and (entry.future is None or entry.future.cancel()):
                for later in list(self.entries)[place:]:
                    if later.future is not None:
                        later.future.cancel()
                while len(self.entries) > place:
                    self.entries.pop()
                return

    def _known(self, entry: _Entry) -> bool:
        """Whether it is known what an entry is to play, for an agent that searches."""
        search = self.searches.get(entry.agent)
        return search is None or search.ready(entry.run)

    def _job(self, entry: _Entry) -> Job:
        """The job of an entry."""
        search = self.searches.get(entry.agent)
        memory = search.memory(entry.run) if search else self.memories.get(entry.agent)
        return job(self.prepared.plan, entry.run, memory)

    def _submit(self, entry: _Entry) -> None:
        """Hand an entry to the executor."""
        try:
            entry.future = self.executor.submit(play, self.prepared, self._job(entry))
        except RuntimeError as error:  # the error of executors that are shut down or broken
            raise BatchError(f"the executor takes no more episodes: {error}") from error

    def _answer(self, entry: _Entry, future: Future[Answer]) -> Answer:
        """The answer of an entry; an episode lost by the executor is an error."""
        try:
            return future.result()
        except (CancelledError, BrokenExecutor, OSError) as error:
            said = f"{type(error).__name__} {error}".strip()
            raise BatchError(f"the executor is gone: {said}") from error
        except CavsumoError:
            raise
        except Exception as error:  # such as dask's KilledWorker
            said = f"the executor lost it: {type(error).__name__}: {error}"
            lost = self._job(entry)
            plan = self.prepared.plan_of(lost.run)
            return Answer(failed(plan, lost, said, 0.0), lost.memory)
