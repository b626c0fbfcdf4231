"""Temporary folders of the processes that we start, in which those and their daemons are known.

Each such process has the name of its folder in its environment (TMPDIR), and so has whatever it
starts. When the folder is closed they are ended and it is removed.

A parent that is killed cannot do that. So it holds a lock on the folder, which the system lets go
when it dies, and whoever starts next closes the folders that nobody holds. A folder is marked once
it is locked: one that is just being made, or another program's, is never taken for left behind.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import tempfile
from functools import cache
from pathlib import Path

from cavsumo.model.offspring import kill_those_with

PREFIX = "cavsumo-"
MARK = ".cavsumo-folder"


class OwnFolder:
    """A new temporary folder, locked by this process until it is closed.

    Args:
        purpose: part of its name.

    Attributes:
        name: its path.
    """

    def __init__(self, purpose: str) -> None:
        self.name = tempfile.mkdtemp(prefix=f"{PREFIX}{purpose}-")
        self._lock = os.open(self.name, os.O_RDONLY | os.O_DIRECTORY)
        fcntl.flock(self._lock, fcntl.LOCK_EX)
        (Path(self.name) / MARK).write_text(f"{os.getpid()}\n", encoding="ascii")

    def close(self) -> None:
        """End whoever has it as temporary folder, and remove it with all that is in it."""
        sweep(Path(self.name))  # folders of a process that had it and died
        kill_those_with(self.name)
        shutil.rmtree(self.name, ignore_errors=True)
        os.close(self._lock)


@cache
def sweep_once() -> None:
    """Close what killed owners have left behind, at the first call in this process."""
    sweep(Path(tempfile.gettempdir()))


def sweep(where: Path) -> None:
    """Close the folders whose owners are dead."""
    for folder in sorted(where.glob(f"{PREFIX}*")):
        with contextlib.suppress(OSError):  # another user's, or gone meanwhile
            _sweep(folder)


def _sweep(folder: Path) -> None:
    """Close one folder if it was locked and nobody holds it any more."""
    if folder.lstat().st_uid != os.getuid() or not (folder / MARK).is_file():
        return
    lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        sweep(folder)  # those of the egos lie in that of the process that simulates
        kill_those_with(str(folder))
        shutil.rmtree(folder, ignore_errors=True)
    finally:
        os.close(lock)
