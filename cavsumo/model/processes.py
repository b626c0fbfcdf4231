"""Child processes: ending with their parent, and a text for how a process ended."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Started = TypeVar("Started")
PR_SET_PDEATHSIG = 1  # Linux, prctl(2)
OUTER_PATH = "CAVSUMO_OUTER_PYTHONPATH"  # what PYTHONPATH was before it was set for our own


def end_with_parent(parent: int) -> Callable[[], None]:
    """A function for a new process to call, so that Linux kills it when its parent dies.

    It is made before the process, so that no library is loaded between fork and exec.
    """
    bind: Callable[[], object] = int
    if sys.platform == "linux":
        import ctypes

        prctl = ctypes.CDLL(None).prctl
        bind = lambda: prctl(PR_SET_PDEATHSIG, signal.SIGKILL)  # noqa: E731

    def put_on() -> None:
        bind()
        if os.getppid() != parent:  # it has died already
            os._exit(1)

    return put_on


_LASTING: dict[int, ThreadPoolExecutor] = {}  # by process, because a fork has no threads


def by_a_lasting_thread(start: Callable[[], Started]) -> Started:
    """Start a process from a thread that ends only with this process.

    For Linux a parent dies when the thread ends that started the child (prctl(2),
    PR_SET_PDEATHSIG), and the threads of an executor end before the processes that they started.
    """
    executor = _LASTING.setdefault(os.getpid(), ThreadPoolExecutor(1, "cavsumo-start"))
    return executor.submit(start).result()


def ending(code: int) -> str:
    """How a process ended, from its exit status or the number of the signal, negative."""
    if code < 0:
        names = {s.value: s.name for s in signal.Signals}
        return f"died of {names.get(-code, f'signal {-code}')}"
    return f"ended with status {code}"


def last_words(log: int) -> str:
    """The last line of a file, given its descriptor, in brackets after a space; or nothing."""
    text = os.pread(log, os.fstat(log).st_size, 0).decode("utf-8", errors="replace")
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return f" ({lines[-1]})" if lines else ""


def inner_environment() -> dict[str, str]:
    """The environment of a process of cavsumo that finds the modules that this one finds."""
    outer = os.environ.get("PYTHONPATH", "")
    return {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), OUTER_PATH: outer}


def outer_environment() -> dict[str, str]:
    """The environment without the entries that ``inner_environment`` has added."""
    environment = dict(os.environ)
    outer = environment.pop(OUTER_PATH, None)
    if outer is not None:
        environment.pop("PYTHONPATH", None)
    return environment | ({"PYTHONPATH": outer} if outer else {})
