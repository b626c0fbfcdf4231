"""Lines to an external ego and back, each reply within a deadline, over file descriptors.

There is one thread, and every buffer has a bound. The ego's stderr is read while waiting for a
reply, and its output while writing, so neither side can block the other for ever.
"""

from __future__ import annotations

import contextlib
import math
import os
import select
import time
from abc import ABC, abstractmethod

from cavsumo.egos.external.last_words import telling_line
from cavsumo.egos.external.protocol import shown
from cavsumo.errors import EgoError

LINE_LIMIT = 65536  # bytes of a reply, its end not counted
LOG_LIMIT = 65536  # bytes kept of its stderr
CHUNK = 65536


class ExtraLineError(EgoError):
    """The ego wrote more lines than it was asked for.

    Attributes:
        line: the first line received, possibly an answer, possibly incomplete.
    """

    def __init__(self, message: str, line: bytes) -> None:
        super().__init__(message)
        self.line = line


class GoneError(EgoError):
    """The ego ended, or is silent."""


class Tail:
    """The last LOG_LIMIT bytes of a stream, and the number of bytes before them."""

    def __init__(self) -> None:
        self._data, self._cut = bytearray(), 0

    def add(self, chunk: bytes) -> None:
        """Append bytes and drop the first ones beyond the limit."""
        self._data += chunk
        excess = len(self._data) - LOG_LIMIT
        if excess > 0:
            del self._data[:excess]
            self._cut += excess

    def take(self) -> str:
        """Remove and return the content as text, after a note if bytes were cut."""
        text = self._data.decode("utf-8", errors="backslashreplace")
        note = f"[{self._cut} bytes before this are cut]\n" if self._cut else ""
        self._data, self._cut = bytearray(), 0
        return note + text

    def state(self) -> tuple[bytes, int]:
        """The present content, for ``back_to``."""
        return bytes(self._data), self._cut

    def back_to(self, state: tuple[bytes, int]) -> None:
        """Drop the bytes received since a state."""
        self._data, self._cut = bytearray(state[0]), state[1]

    def telling_line(self) -> str:
        """The line with the reason of its writer's end, shortened; empty for none."""
        return telling_line(self._data.decode("utf-8", errors="replace"))


class Link(ABC):
    """The connection to one external ego: asked line by line, ended once.

    Args:
        sink, source: descriptors to write to and to read from; they are made non-blocking.
        errors: one more to read from, whose bytes go to the tail.
    """

    def __init__(self, sink: int, source: int, errors: int | None, tail: Tail) -> None:
        self.sink, self.source, self.errors, self.tail = sink, source, errors, tail
        self._reading, self._writing = select.poll(), select.poll()
        for fd in {source, *([] if errors is None else [errors])}:
            os.set_blocking(fd, False)
            self._reading.register(fd, select.POLLIN)
            self._writing.register(fd, select.POLLIN)
        os.set_blocking(sink, False)
        both = select.POLLOUT | (select.POLLIN if sink == source else 0)
        self._writing.register(sink, both)

    def ask(self, line: bytes, seconds: float) -> bytes:
        """The one line that answers a line; raises EgoError for anything else.

        That is ExtraLineError for a second line and GoneError for none.
        """
        deadline = time.monotonic() + seconds
        self._check_unasked()
        self._send(line, deadline, seconds)
        return self._receive(deadline, seconds)

    def drain(self) -> None:
        """Read its stderr."""
        if self.errors is not None:
            with contextlib.suppress(OSError):
                while chunk := os.read(self.errors, CHUNK):
                    self.tail.add(chunk)

    @abstractmethod
    def end(self, farewell: bytes = b"") -> None:
        """End it: at once, or after a short while in which it may end itself after a last line."""

    @abstractmethod
    def _gone(self) -> str:
        """The error for an ego that no longer reads or writes."""

    def _send(self, line: bytes, deadline: float, seconds: float) -> None:
        """Write a line, reading meanwhile."""
        left = memoryview(line)
        while True:
            try:
                left = left[os.write(self.sink, left) :]
            except BlockingIOError:
                pass
            except OSError:
                raise GoneError(self._gone()) from None
            if not left:
                return
            if not self._wait(self._writing, deadline):
                raise EgoError(f"did not read its input within {seconds:g} s")
            self._check_unasked()

    def _check_unasked(self) -> None:
        """Raise ExtraLineError if it has written a line without being asked."""
        if unasked := self._read():
            said = f"wrote {shown(unasked)} before it was asked"
            raise ExtraLineError(said, unasked.partition(b"\n")[0])

    def _receive(self, deadline: float, seconds: float) -> bytes:
        """The next line."""
        received = b""
        while True:
            in_time = self._wait(self._reading, deadline)
            received += self._read()
            line, end, more = received.partition(b"\n")
            if len(line) > LINE_LIMIT:
                raise EgoError(f"answered with a line longer than {LINE_LIMIT} bytes")
            if more:
                raise ExtraLineError(f"wrote {shown(more)} after its answer", line)
            if end:
                return line
            if not in_time:
                raise GoneError(f"gave no answer within {seconds:g} s")

    def _wait(self, poll: select.poll, deadline: float) -> bool:
        """Wait until something can be read or written; whether there is time left then."""
        left = deadline - time.monotonic()
        for fd, _ in poll.poll(max(0, math.ceil(1000.0 * left))):
            if fd == self.errors:
                self._read_errors()
        return left > 0.0

    def _read(self) -> bytes:
        """The bytes available now, up to a bound; raises EgoError at the end of the stream."""
        try:
            chunk = os.read(self.source, CHUNK)
        except BlockingIOError:
            return b""
        except OSError:
            chunk = b""
        if not chunk:
            raise GoneError(self._gone())
        return chunk

    def _read_errors(self) -> None:
        """Read some of its stderr; close it at its end."""
        assert self.errors is not None
        try:
            chunk = os.read(self.errors, CHUNK)
        except OSError:
            chunk = b""
        self.tail.add(chunk)
        if not chunk:
            self._reading.unregister(self.errors)
            self._writing.unregister(self.errors)
