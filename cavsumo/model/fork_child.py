"""The child's side of a fork: it stands alone, computes, sends its outcome and ends."""

from __future__ import annotations

import contextlib
import fcntl
import os
import pickle
import signal
import stat
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from cavsumo.errors import CavsumoError
from cavsumo.model.offspring import kill_descendants

CHUNK = 1 << 20  # bytes read at once
HEAD = 8  # bytes in which a child sends the length of its result
ALARM_AFTER_S = 30.0  # time after its deadline at which a child ends by itself


def flush() -> None:
    """Write out what is buffered, or both processes would write it."""
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            with contextlib.suppress(OSError, ValueError):
                stream.flush()


def places() -> dict[int, int | None]:
    """The open descriptors but stdout and stderr; those of files being read with their places."""
    found: dict[int, int | None] = {}
    for entry in Path("/proc/self/fd").iterdir():
        number = int(entry.name)
        if number in (1, 2):
            continue
        with contextlib.suppress(OSError):  # that of the listing itself
            reads = fcntl.fcntl(number, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY
            is_file = stat.S_ISREG(os.fstat(number).st_mode)
            found[number] = os.lseek(number, 0, os.SEEK_CUR) if reads and is_file else None
    return found


def stand_alone(places: Mapping[int, int | None], deadline: float) -> None:
    """Share no descriptor and no signal handler with the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides what Ctrl-C means
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.setitimer(signal.ITIMER_REAL, deadline + ALARM_AFTER_S)
    # A file that nothing refers to may have been closed since it was listed.
    here = {number: place for number, place in places.items() if _is_open(number)}
    nowhere = os.open(os.devnull, os.O_RDWR)
    for number, place in here.items():
        own = nowhere if place is None else _opened_again(number)
        if place is not None:
            os.lseek(own, place, os.SEEK_SET)
        os.dup2(own, number, inheritable=False)
        if place is not None:
            os.close(own)


def _is_open(number: int) -> bool:
    """Whether there is such a descriptor."""
    try:
        os.fstat(number)
    except OSError:
        return False
    return True


def _opened_again(number: int) -> int:
    """A descriptor of the same file with a place of its own; of a copy if it is there no more."""
    try:
        return os.open(f"/proc/self/fd/{number}", os.O_RDONLY)
    except OSError:  # some kernels do not open what has no name any more
        copied, start = os.memfd_create("copied"), 0
        while piece := os.pread(number, CHUNK, start):
            start += os.write(copied, piece)
        return copied


def outcome(work: Callable[[], Any]) -> bytes:
    """Whether a work succeeded, and its result or a sentence, pickled."""
    try:
        return pickle.dumps((True, work()), pickle.HIGHEST_PROTOCOL)
    except CavsumoError as error:
        return pickle.dumps((False, str(error)))
    except Exception as error:
        return pickle.dumps((False, f"defect: {error!r}"))


def send(sink: int, data: bytes) -> None:
    """Send all of a result, its length first."""
    left = memoryview(len(data).to_bytes(HEAD, "little") + data)
    while left:
        left = left[os.write(sink, left) :]


def leave() -> None:
    """End this process, and before it those that it has started."""
    flush()
    if has_children(os.getpid()):
        kill_descendants(os.getpid())
    os._exit(0)


def has_children(pid: int) -> bool:
    """Whether a process has children; True where the system does not say."""
    try:
        return bool(Path(f"/proc/{pid}/task/{pid}/children").read_bytes())
    except OSError:
        return True
