"""An ego that is a child process: its stdin and stdout carry the lines, its stderr is kept."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import time
from collections.abc import Sequence

from cavsumo.egos.external.link import Link, Tail
from cavsumo.errors import EgoError
from cavsumo.model.offspring import kill_descendants
from cavsumo.model.own_folders import OwnFolder
from cavsumo.model.processes import end_with_parent, ending, outer_environment

GRACE_S = 1.0  # time that it has to end by itself
GLANCE_S = 0.01  # interval of checks whether it has


class Child(Link):
    """A command that runs in the process group of this process and is killed with it.

    It has three pipes, none of our other descriptors, the default signal handlers, and the
    environment of the command line with its own temporary folder, which identifies its daemons.
    """

    def __init__(self, words: Sequence[str], tail: Tail) -> None:
        follow_parent = end_with_parent(os.getpid())

        def before_exec() -> None:
            follow_parent()
            signal.signal(signal.SIGINT, signal.SIG_DFL)  # a process of cavsumo ignores it

        self._folder = OwnFolder("ego")
        try:
            self._process = subprocess.Popen(
                words,
                bufsize=0,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                env=outer_environment() | {"TMPDIR": self._folder.name},
                preexec_fn=before_exec,  # this process has no threads
            )
        except (OSError, ValueError, subprocess.SubprocessError) as error:
            self._folder.close()
            said = getattr(error, "strerror", None) or str(error)
            raise EgoError(f"cannot be started: {said}: {words[0]!r}") from error
        stdin, stdout, stderr = self._process.stdin, self._process.stdout, self._process.stderr
        assert stdin
        assert stdout
        assert stderr
        self._pipes = stdin, stdout, stderr
        super().__init__(stdin.fileno(), stdout.fileno(), stderr.fileno(), tail)

    def end(self, farewell: bytes = b"") -> None:
        process = self._process
        if farewell and process.poll() is None:
            with contextlib.suppress(OSError):
                os.write(self.sink, farewell)
            self._pipes[0].close()
            self._watch(GRACE_S)
        kill_descendants(process.pid)
        process.kill()  # also if it is stopped; harmless if it has ended
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(10.0)
        self._folder.close()
        self.drain()
        for pipe in self._pipes:
            pipe.close()

    def _gone(self) -> str:
        code = self._watch(GRACE_S)
        if code is None:
            return "closed its stdin or stdout"
        last = self.tail.telling_line()
        return ending(code) + (f" ({last})" if last else "")

    def _watch(self, seconds: float) -> int | None:
        """Wait for its end and read its output meanwhile; None if it does not end."""
        deadline = time.monotonic() + seconds
        while (code := self._process.poll()) is None and time.monotonic() < deadline:
            self.drain()
            with contextlib.suppress(OSError):
                os.read(self.source, 65536)  # so that it can write and end
            time.sleep(GLANCE_S)
        self.drain()
        return code
