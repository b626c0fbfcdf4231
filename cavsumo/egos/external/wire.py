"""An ego that listens at a TCP port, on this machine or another."""

from __future__ import annotations

import contextlib
import os
import socket

from cavsumo.egos.external.link import Link, Tail
from cavsumo.errors import EgoError, InputError


class Wire(Link):
    """A connection; its other end sees it close when the ego is ended."""

    def __init__(self, host: str, port: int, seconds: float, tail: Tail) -> None:
        try:
            self._socket = socket.create_connection((host, port), seconds)
        except (OSError, UnicodeError) as error:
            said = getattr(error, "strerror", None) or str(error)
            raise EgoError(f"cannot be reached: {said}") from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        fd = self._socket.fileno()
        super().__init__(fd, fd, None, tail)

    def end(self, farewell: bytes = b"") -> None:
        with contextlib.suppress(OSError):
            if farewell:
                os.write(self.sink, farewell)
        self._socket.close()

    def _gone(self) -> str:
        return "closed the connection"


def host_and_port(address: str) -> tuple[str, int]:
    """``HOST:PORT`` or ``[IPv6]:PORT`` as its parts; raises InputError."""
    host, _, port = address.rpartition(":")
    host = host.removeprefix("[").removesuffix("]")
    if not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise InputError(f"ego 'tcp:{address}': expected tcp:HOST:PORT, such as tcp:127.0.0.1:5000")
    return host, int(port)
