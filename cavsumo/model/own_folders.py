"""Temporary folders of the processes that we start, which identify those and their daemons.

Each such process has the name of its folder in its environment (TMPDIR), and so have the processes
that it starts. Closing the folder ends them and removes it.

A parent that is killed cannot do that. It therefore holds a lock on the folder, which the system
releases when it dies, and the next process closes the folders that are not locked. A folder is
marked after it is locked, so that a folder in the making, or of another program, is never closed.
"""

from __future__ import annotations

import atexit
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
        """End the processes that have it as temporary folder, and remove it with its content."""
        sweep(Path(self.name))  # folders of a process that had it and died
        kill_those_with(self.name)
        shutil.rmtree(self.name, ignore_errors=True)
        os.close(self._lock)


def process_folder(purpose: str) -> Path:
    """The temporary folder of this process for a purpose, removed at its end.

    A fork of a process has another one.
    """
    return Path(_folder_of(os.getpid(), purpose).name)


@cache
def _folder_of(process: int, purpose: str) -> OwnFolder:
    """The folder of a process."""
    own = OwnFolder(purpose)
    atexit.register(close_own, own, process)
    return own


def close_own(own: OwnFolder, owner: int) -> None:
    """Remove a folder, unless this process is a fork of its owner."""
    if os.getpid() == owner:
        own.close()


@cache
def sweep_once() -> None:
    """Close the folders of killed owners, at the first call in this process."""
    sweep(Path(tempfile.gettempdir()))


def sweep(where: Path) -> None:
    """Close the folders whose owners are dead."""
    for folder in sorted(where.glob(f"{PREFIX}*")):
        with contextlib.suppress(OSError):  # another user's, or gone meanwhile
            _sweep(folder)


def _sweep(folder: Path) -> None:
    """Close one folder if it was locked and is not locked any more."""
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
