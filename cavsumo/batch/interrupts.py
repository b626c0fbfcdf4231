"""Ctrl-C, and the signals by which schedulers end a job: finish running episodes, then stop."""

from __future__ import annotations

import signal
import sys
import threading
from types import FrameType, TracebackType

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Interrupts:
    """Counts interrupts while it is entered; a context manager, called to ask.

    The first one asks to stop, the second raises KeyboardInterrupt.
    """

    def __init__(self, quiet: bool) -> None:
        self.asked, self._quiet = False, quiet

    def __call__(self) -> bool:
        """Whether the user asked to stop."""
        return self.asked

    def __enter__(self) -> Interrupts:
        self._before = {}
        if threading.current_thread() is threading.main_thread():  # elsewhere Python has no signals
            heard = [s for s in SIGNALS if signal.getsignal(s) != signal.SIG_IGN]  # as by nohup
            self._before = {s: signal.signal(s, self._heard) for s in heard}
        return self

    def __exit__(
        self, _: type[BaseException] | None, __: BaseException | None, ___: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _heard(self, number: int, _: FrameType | None) -> None:
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True
        if not self._quiet:
            print("cavsumo: finishing what runs; once more to stop at once", file=sys.stderr)
