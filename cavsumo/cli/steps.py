"""The current step of a command that takes long, and the files it has written, on stderr."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

AFTER_S = 2.0  # of silence


class SlowSteps:
    """Shows the current step, from AFTER_S on; a context manager.

    A terminal has one line, which goes at the end; elsewhere each step is a line.

    Args:
        quiet: show nothing.
    """

    def __init__(self, *, quiet: bool = False) -> None:
        self._quiet, self._step, self._detail, self._said = quiet, "", "", ""
        self._lock = threading.Lock()
        self._timer = threading.Timer(AFTER_S, self._show)
        self._timer.daemon = True
        self._line: Any = None  # of a terminal

    def __enter__(self) -> SlowSteps:
        self._begun = time.monotonic()
        if not self._quiet:
            self._timer.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._timer.cancel()
        with self._lock:
            self._quiet = True
            if self._line is not None:
                self._line.stop()

    def begin(self, step: str, detail: str = "") -> None:
        """Begin a step, such as "writing pages", or tell more of it, such as "3 of 20"."""
        self._step, self._detail = step, detail
        if time.monotonic() - self._begun >= AFTER_S:
            self._show()

    def _show(self) -> None:
        """Show the current step: its details on a terminal, itself once elsewhere."""
        with self._lock:
            if self._quiet or not self._step:
                return
            if sys.stderr.isatty():
                self._update()
            elif self._step != self._said:
                self._said = self._step
                print(f"cavsumo: {self._step} ...", file=sys.stderr, flush=True)

    def _update(self) -> None:
        """Show the current step in the line of a terminal."""
        if self._line is None:
            self._line = _line()
            self._line.add_task("", total=None)
            self._line.start()
        said = f"{self._step}, {self._detail}" if self._detail else self._step
        self._line.update(self._line.task_ids[0], description=said, refresh=True)


def _line() -> Any:
    """A line with a step, on stderr."""
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn

    said = TextColumn("{task.description}", markup=False)
    columns = SpinnerColumn(), said
    return Progress(*columns, console=Console(stderr=True), transient=True, redirect_stdout=False)


def say_written(files: Iterable[Path | str | None], *, quiet: bool = False) -> None:
    """Print the names of files that were written on stderr, a line each; None is none."""
    for file in files:
        if file is not None and not quiet:
            print(f"cavsumo: wrote {file}", file=sys.stderr)
