"""Results computed in forked children of this process, each with a deadline (Linux).

A child has all that this process has in memory, and shares none of its conversations: files that
are being read are opened once more at the same place; pipes, sockets and files that are written
lead nowhere, except stdout and stderr. It ends by ``os._exit``, so that it cleans up nothing that
belongs to this process, and Linux kills it when this process dies.
"""

from __future__ import annotations

import os
import pickle
import random
import resource
import selectors
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Mapping
from functools import cache
from typing import Any, Generic, TypeVar

from cavsumo.errors import BranchError, plain
from cavsumo.model.fork_child import (
    ALARM_AFTER_S,
    CHUNK,
    HEAD,
    flush,
    has_children,
    leave,
    outcome,
    places,
    send,
    stand_alone,
)
from cavsumo.model.offspring import kill_descendants
from cavsumo.model.processes import end_with_parent, ending

Result = TypeVar("Result")

MEASURED = 3  # forks of which the cost is taken


def can_fork() -> bool:
    """Whether a fork of this process has all that it needs.

    A fork has one thread, so what other threads of Python hold would be held for ever. Threads of
    numpy's linear algebra end before a fork and begin anew after it.
    """
    return sys.platform == "linux" and threading.active_count() == 1


class Fork(Generic[Result]):
    """A child that computes one result.

    Args:
        work: called in the child; its result must be picklable.
        deadline: how long it may take [s].
        keep: descriptors of this process that the child keeps.

    Attributes:
        source: the descriptor from which its result is read.
        ends: when it is due, on the clock of ``time.monotonic`` [s].
        code: once it has ended, its exit status, or the number of the signal, negative.
    """

    code: int | None = None

    def __init__(
        self, work: Callable[[], Result], deadline: float, keep: Iterable[int] = ()
    ) -> None:
        self._deadline, self.ends = deadline, time.monotonic() + deadline
        self._received = bytearray()
        self.source, sink = os.pipe()  # before the listing, so that it takes no number of it
        open_now, follow_parent = places(), end_with_parent(os.getpid())
        for kept in (sink, *keep):
            open_now.pop(kept, None)
        drawn = random.getstate()  # Python seeds it anew in a fork
        flush()
        try:
            self._pid = os.fork()
        except OSError as error:
            os.close(self.source)
            os.close(sink)
            raise BranchError(f"no process for a branch: {plain(error)}") from error
        if self._pid == 0:
            try:
                follow_parent()
                send(sink, outcome(lambda: alone(open_now, deadline, drawn, work)))
                leave()
            finally:
                os._exit(1)
        os.close(sink)

    def receive(self) -> bool:
        """Read what has arrived; whether that is all of the result, or all that there will be."""
        piece = os.read(self.source, CHUNK)
        self._received += piece
        return not piece or len(self._received) >= HEAD + self._length()

    def result(self) -> Result:
        """The result that was received; raises BranchError if it is none."""
        length = self._length()
        if len(self._received) < HEAD + length:
            raise BranchError(f"a branch {self.end()}")
        good, value = pickle.loads(memoryview(self._received)[HEAD : HEAD + length])
        self.end()
        if not good:
            raise BranchError(value)
        result: Result = value
        return result

    def awaited(self, deadline: float) -> Result:
        """The result as soon as it is there; raises BranchError, also after a deadline [s]."""
        ends = time.monotonic() + deadline
        with selectors.DefaultSelector() as selector:
            selector.register(self.source, selectors.EVENT_READ)
            while selector.select(max(0.0, ends - time.monotonic())):
                if self.receive():
                    return self.result()
        raise self.overdue()

    def overdue(self) -> BranchError:
        """The error of a child that took too long, which is killed."""
        self.kill()
        return BranchError(f"a branch gave no result within {self._deadline:g} s")

    def end(self) -> str:
        """Wait for the end of a child that has sent all; how it ended, in words."""
        os.close(self.source)
        _, status = os.waitpid(self._pid, 0)
        self.code = os.waitstatus_to_exitcode(status)
        return ending(self.code)

    def kill(self) -> None:
        """Kill the child and what it has started."""
        os.kill(self._pid, signal.SIGSTOP)  # so that it starts no others
        if has_children(self._pid):
            kill_descendants(self._pid)
        os.kill(self._pid, signal.SIGKILL)
        self.end()

    def _length(self) -> int:
        """The length of the result, as far as it is known."""
        return int.from_bytes(self._received[:HEAD], "little")


def alone(
    open_now: Mapping[int, int | None], deadline: float, drawn: Any, work: Callable[[], Result]
) -> Result:
    """The result of a work in a child that shares nothing with its parent any more."""
    stand_alone(open_now, deadline)
    random.setstate(drawn)
    return work()


def forked(
    works: Iterable[Callable[[], Result]], *, at_once: int, deadline: float
) -> Generator[Result | BranchError]:
    """The result of each work, or its error, in their order.

    Args:
        at_once: children that run at the same time, at most.
        deadline: of each [s].
    """
    waiting, running = iter(works), deque[_Running[Result]]()
    with selectors.DefaultSelector() as selector:
        try:
            while True:
                while len(running) < at_once and (work := next(waiting, None)) is not None:
                    running.append(_Running(work, deadline, selector))
                if not running:
                    return
                while not running[0].done:
                    _wait(selector, running)
                yield running.popleft().outcome
        finally:
            for one in running:
                one.abandon()


def result_of(work: Callable[[], Result], deadline: float) -> Result | BranchError:
    """The result of one work, or its error."""
    (found,) = forked([work], at_once=1, deadline=deadline)
    return found


@cache
def cost_of_fork() -> float:
    """Processor time of a fork that does nothing, of both processes [s]; measured once."""
    before = _processor_time()
    for _ in range(MEASURED):
        result_of(int, ALARM_AFTER_S)
    return (_processor_time() - before) / MEASURED


def _processor_time() -> float:
    """Processor time of this process and its children that have ended [s]."""
    uses = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(use.ru_utime + use.ru_stime for use in uses)


class _Running(Generic[Result]):
    """A child whose result is awaited, and then its outcome."""

    outcome: Result | BranchError

    def __init__(
        self, work: Callable[[], Result], deadline: float, selector: selectors.BaseSelector
    ) -> None:
        self.done, self._selector = False, selector
        self.fork = Fork(work, deadline)
        selector.register(self.fork.source, selectors.EVENT_READ, self)

    def read(self) -> None:
        """Take what has arrived."""
        if self.fork.receive():
            self._finish()
            try:
                self.outcome = self.fork.result()
            except BranchError as error:
                self.outcome = error

    def check(self) -> None:
        """Kill it if it is overdue."""
        if not self.done and time.monotonic() >= self.fork.ends:
            self._finish()
            self.outcome = self.fork.overdue()

    def abandon(self) -> None:
        """Kill it if it is not done."""
        if not self.done:
            self._finish()
            self.fork.kill()

    def _finish(self) -> None:
        self.done = True
        self._selector.unregister(self.fork.source)


def _wait(selector: selectors.BaseSelector, running: Iterable[_Running[Any]]) -> None:
    """Wait until something arrives or is overdue, and see to it."""
    next_end = min(one.fork.ends for one in running if not one.done)
    for key, _ in selector.select(max(0.0, next_end - time.monotonic())):
        key.data.read()
    for one in running:
        one.check()
