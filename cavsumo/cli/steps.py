"""The current step of a command, printed on stderr if the command takes long."""

from __future__ import annotations

import sys
import threading
import time

AFTER_S = 2.0  # of silence


class SlowSteps:
    """Prints the current step, from AFTER_S on; a context manager.

    Args:
        quiet: print nothing.
    """

    def __init__(self, *, quiet: bool = False) -> None:
        self._quiet, self._step, self._said = quiet, "", ""
        self._lock = threading.Lock()
        self._timer = threading.Timer(AFTER_S, self._say)
        self._timer.daemon = True

    def __enter__(self) -> SlowSteps:
        self._begun = time.monotonic()
        if not self._quiet:
            self._timer.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._timer.cancel()

    def begin(self, step: str) -> None:
        """Begin a step, such as "drawing"."""
        self._step = step
        if not self._quiet and time.monotonic() - self._begun >= AFTER_S:
            self._say()

    def _say(self) -> None:
        """Print the current step, once."""
        with self._lock:
            if self._step != self._said:
                self._said = self._step
                print(f"cavsumo: {self._step} ...", file=sys.stderr, flush=True)
