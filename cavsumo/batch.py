"""Many episodes over any executor, their outcomes in the order of their numbers.

Whatever finishes first and wherever it was played, what comes out is the same. Episodes are
independent of each other, but for agents that learn: those take their memory along from one of
their episodes to the next, so they learn in sequence while the episodes of others fill the
executor. What was learned can then be played in parallel (``learn=false``).
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

from cavsumo.errors import BatchError, CavsumoError
from cavsumo.jobs import failed, job, learners
from cavsumo.setting import Setting
from cavsumo.worker import Answer, play

POLL_S = 0.2  # how often to look whether to stop, while nothing finishes


def run_batch(
    setting: Setting,
    executor: Executor,
    todo: Iterable[int],
    *,
    memories: Mapping[str, Any] | None = None,
    ahead: int = 16,
    stopped: Callable[[], bool] = lambda: False,
) -> Iterator[Answer]:
    """The outcomes of a batch in the order of ``todo``, with what the agents know after each.

    Closing the iterator gives up what has not come out yet.

    Args:
        executor: plays jobs by ``cavsumo.worker.play``, in threads or in processes anywhere.
        todo: numbers of episodes, ascending.
        memories: what learning agents know already, by name.
        ahead: how many episodes to have under way or waiting for their turn to come out.
        stopped: asked all the time; once true, what runs is finished and nothing more is begun.
    """
    line = _Line(setting, executor, dict(memories or {}))
    runs = iter(todo)
    try:
        while True:
            if stopped():
                line.call_off()
            else:
                line.join(runs, ahead)
            if not line.entries:
                return
            line.advance()
            yield from line.ready()
    finally:
        line.call_off()


@dataclass
class _Entry:
    """An episode between being asked for and coming out."""

    run: int
    agent: str
    future: Future[Answer] | None = None
    answer: Answer | None = None


class _Line:
    """Episodes in the order in which they come out; each is submitted as soon as it can be."""

    def __init__(self, setting: Setting, executor: Executor, memories: dict[str, Any]) -> None:
        self.setting, self.executor, self.memories = setting, executor, memories
        self.entries: deque[_Entry] = deque()
        self._learners = learners(setting.plan)

    def join(self, runs: Iterator[int], ahead: int) -> None:
        """Take up episodes until so many are in line, and submit those that can start."""
        agents = self.setting.plan.agents
        while len(self.entries) < ahead and (run := next(runs, None)) is not None:
            self.entries.append(_Entry(run, agents[run % len(agents)]))
        learning = set()
        for entry in self.entries:
            if entry.answer is None and entry.agent in self._learners:
                if entry.agent in learning:
                    continue  # its turn comes when it knows what the episode before teaches
                learning.add(entry.agent)
            if entry.future is None:
                self._submit(entry)

    def advance(self) -> None:
        """Wait a moment for something to finish."""
        waiting = [e for e in self.entries if e.future is not None and e.answer is None]
        wait([e.future for e in waiting if e.future], POLL_S, return_when=FIRST_COMPLETED)
        for entry in waiting:
            if entry.future is not None and entry.future.done():
                entry.answer = self._answer(entry, entry.future)
                if entry.agent in self._learners:
                    self.memories[entry.agent] = entry.answer[1]

    def ready(self) -> Iterator[Answer]:
        """What can come out: all that is finished before the first that is not."""
        while self.entries and (answer := self.entries[0].answer) is not None:
            self.entries.popleft()
            yield answer

    def call_off(self) -> None:
        """Drop what has not started, and what would come out behind it."""
        for place, entry in enumerate(self.entries):
            if entry.answer is None and (entry.future is None or entry.future.cancel()):
                for later in list(self.entries)[place:]:
                    if later.future is not None:
                        later.future.cancel()
                while len(self.entries) > place:
                    self.entries.pop()
                return

    def _submit(self, entry: _Entry) -> None:
        """Hand an episode to the executor."""
        work = job(self.setting.plan, entry.run, self.memories.get(entry.agent))
        try:
            entry.future = self.executor.submit(play, self.setting, work)
        except RuntimeError as error:  # as executors say that they are shut down or broken
            raise BatchError(f"the executor takes no more episodes: {error}") from error

    def _answer(self, entry: _Entry, future: Future[Answer]) -> Answer:
        """The answer of an episode; what the executor lost is an error of that episode."""
        try:
            return future.result()
        except (CancelledError, BrokenExecutor, OSError) as error:
            said = f"{type(error).__name__} {error}".strip()
            raise BatchError(f"the executor is gone: {said}") from error
        except CavsumoError:
            raise
        except Exception as error:  # such as dask's KilledWorker
            work = job(self.setting.plan, entry.run, self.memories.get(entry.agent))
            said = f"the executor lost it: {type(error).__name__}: {error}"
            return failed(self.setting.plan, work, said, 0.0), work.memory
