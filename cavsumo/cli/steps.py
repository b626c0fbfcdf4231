"""What a command is doing, said on stderr once it has taken longer than a user likes to wait."""

from __future__ import annotations

import sys
import threading
import time

AFTER_S = 2.0  # of silence


class SlowSteps:
    """Says which step is under way, from AFTER_S on; a context manager.

    Args:
        quiet: say nothing.
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
        """A step begins: what is done, such as "drawing"."""
        self._step = step
        if not self._quiet and time.monotonic() - self._begun >= AFTER_S:
            self._say()

    def _say(self) -> None:
        """Name the step under way, once."""
        with self._lock:
            if self._step != self._said:
                self._said = self._step
                print(f"cavsumo: {self._step} ...", file=sys.stderr, flush=True)
