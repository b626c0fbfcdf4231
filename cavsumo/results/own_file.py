"""A file that one process alone writes, at its end, and that is whole at every moment.

It is locked while it is written. Data is appended at once or not at all. That another process has
removed, cut or changed the file is noticed before more is written.
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import os
from collections.abc import Callable
from io import FileIO
from pathlib import Path

from cavsumo.errors import BatchError, ResultsError


class OwnFile:
    """A results file, created if need be and locked until it is closed.

    Attributes:
        path: where it is.
        created: whether it was not there before.
        size: how many of its bytes are whole and this process's own.
        sum: the SHA-256 of them.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.created = path, not path.exists()
        self.size, self.sum = 0, hashlib.sha256()
        self._stream = _locked(path)
        self._changed = 0  # when the own bytes were written [ns]

    def close(self) -> None:
        """Close it, which gives the lock back."""
        self._stream.close()

    def truncate(self) -> None:
        """Cut off all that is behind its own bytes."""
        self._stream.truncate(self.size)
        self._seen()

    def append(self, data: bytes) -> None:
        """Append data; none of it stays where the disk takes no more (OSError)."""
        try:
            _write_all(self._stream, data)
        except OSError:
            self.truncate()
            raise
        self.note(data)

    def note(self, data: bytes) -> None:
        """Count bytes that are there already as its own."""
        self.size += len(data)
        self.sum.update(data)
        self._seen()

    def adopt(self, size: int, total: hashlib._Hash) -> None:
        """Count so many first bytes with this SHA-256 as its own."""
        self.size, self.sum = size, total.copy()
        self._seen()

    def flush(self) -> None:
        """Make all of it durable."""
        os.fsync(self._stream.fileno())

    def replace(self, line: Callable[[bytes], bytes]) -> None:
        """Replace every line but the first by what ``line`` makes of it, all at once."""
        new_file = self.path.with_name(f".{self.path.name}.new")
        new_file.unlink(missing_ok=True)
        new = _locked(new_file)
        try:
            with self.path.open("rb") as old, new_file.open("wb") as stream:
                stream.write(old.readline())
                stream.writelines(map(line, old))
                stream.flush()
                os.fsync(stream.fileno())
            new_file.replace(self.path)
        except OSError:
            new.close()
            new_file.unlink(missing_ok=True)
            raise
        self._stream.close()
        self._stream = new
        self.size, self.sum = 0, hashlib.sha256()
        self.note(self.path.read_bytes())

    def check(self) -> None:
        """Raise BatchError unless the file is there, and as this process wrote it."""
        ours = os.fstat(self._stream.fileno())
        try:
            there = self.path.stat()
        except OSError:
            raise self._interfered("was removed") from None
        if not os.path.samestat(ours, there):
            raise self._interfered("was replaced by another file")
        if there.st_size != self.size:
            raise self._interfered(f"has {there.st_size} bytes where {self.size} were written")
        if there.st_mtime_ns != self._changed:
            if hashlib.sha256(self.path.read_bytes()).digest() != self.sum.digest():
                raise self._interfered("was changed")
            self._changed = there.st_mtime_ns

    def _seen(self) -> None:
        """Remember when it was last written."""
        self._changed = os.fstat(self._stream.fileno()).st_mtime_ns

    def _interfered(self, what: str) -> BatchError:
        """The error for results that another process has changed."""
        return BatchError(
            f"results {str(self.path)!r}: the file {what} while the batch was written; nothing "
            "more is written"
        )


def check_free(csv_file: Path) -> None:
    """Raise ResultsError if another run is writing these results; changes nothing."""
    if csv_file.is_file():
        _locked(csv_file).close()


def _locked(file: Path) -> FileIO:
    """A file opened for writing, created if need be and locked until it is closed."""
    try:
        stream = file.open("ab", buffering=0)  # every row is one write at the end
    except OSError as error:
        raise ResultsError(f"results {str(file)!r}: cannot be written: {error.strerror}") from error
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        stream.close()
        if error.errno in (errno.EAGAIN, errno.EACCES):
            raise ResultsError(f"results {str(file)!r}: another run is writing them") from error
        raise ResultsError(f"results {str(file)!r}: no lock: {error.strerror}") from error
    return stream


def _write_all(file: FileIO, data: bytes) -> None:
    """Write all of it; the system may take it in parts."""
    left = memoryview(data)
    while left:
        left = left[file.write(left) :]
