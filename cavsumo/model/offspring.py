"""The processes that a process of ours has started, directly or not, found and ended (Linux).

A program may leave its parent: it forks twice, starts its own session, and has no parent of ours.
Two facts still identify it. A process that adopts orphans becomes the parent of the processes that
its descendants leave behind; and each process inherits the environment, in which TMPDIR names a
folder that was made for one process.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from collections.abc import Callable, Collection, Iterable, Iterator
from pathlib import Path

PR_SET_CHILD_SUBREAPER = 36  # Linux, prctl(2)
PROC = Path("/proc")
ROUNDS = 100  # in which a killed process may have started another


def adopt_orphans() -> None:
    """Become the parent of the processes that descendants of this process leave behind."""
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1)


def kill_descendants(parent: int) -> None:
    """Kill all descendants of a process, but not the process itself, until there are none."""
    _kill_until_none(lambda: descendants(parent))


def kill_strays(kept: Collection[int]) -> None:
    """Kill and reap the descendants that this process has, apart from some."""
    here = os.getpid()
    _kill_until_none(lambda: [pid for pid in descendants(here) if pid not in kept])
    for pid in children(here):
        if pid not in kept:
            with contextlib.suppress(ChildProcessError):
                os.waitpid(pid, 0)


def children(parent: int) -> list[int]:
    """The children of a process, those too that have ended but are not yet reaped."""
    return [pid for pid, above, _ in _processes() if above == parent]


def kill_those_with(tmpdir: str) -> None:
    """Kill the processes whose environment names that temporary folder, except this one."""
    _kill_until_none(lambda: _with_environment(b"TMPDIR=" + os.fsencode(tmpdir)))


def descendants(parent: int) -> list[int]:
    """The descendants of a process, without those that have ended but are not yet reaped."""
    children: dict[int, list[int]] = {}
    alive = set()
    for pid, above, state in _processes():
        children.setdefault(above, []).append(pid)
        if state not in "ZX":
            alive.add(pid)
    found: list[int] = []
    waiting = children.get(parent, [])
    while waiting:
        found += waiting
        waiting = [child for pid in waiting for child in children.get(pid, [])]
    return [pid for pid in found if pid in alive]


def _kill_until_none(find: Callable[[], Iterable[int]]) -> None:
    """Kill the processes found, and look again, because they may have started others."""
    for _ in range(ROUNDS):
        killed = [pid for pid in find() if _killed(pid)]
        for pid in killed:
            with contextlib.suppress(ChildProcessError):  # only the adopted ones are ours to reap
                os.waitpid(pid, 0)
        if not killed:
            return


def _killed(pid: int) -> bool:
    """Kill a process; False if it has ended or belongs to another user."""
    try:
        os.kill(pid, signal.SIGKILL)
    except (ProcessLookupError, PermissionError):
        return False
    return True


def _processes() -> Iterator[tuple[int, int, str]]:
    """The number, the parent's number and the state of every process."""
    for pid in _numbers():
        with contextlib.suppress(OSError):
            state, above = (PROC / str(pid) / "stat").read_bytes().rpartition(b")")[2].split()[:2]
            yield pid, int(above), state.decode()


def _with_environment(entry: bytes) -> Iterator[int]:
    """The processes that were started with an entry in their environment."""
    for pid in _numbers():
        with contextlib.suppress(OSError):
            environment = (PROC / str(pid) / "environ").read_bytes()
            if pid != os.getpid() and entry in environment.split(b"\0"):
                yield pid


def _numbers() -> Iterator[int]:
    """The numbers of all processes, none where the system does not list them."""
    with contextlib.suppress(OSError):
        yield from (int(entry.name) for entry in PROC.iterdir() if entry.name.isdecimal())
