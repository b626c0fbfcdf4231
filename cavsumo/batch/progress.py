"""Progress: a bar in a notebook or on a terminal's stderr, a plain line every tenth elsewhere."""

from __future__ import annotations

import math
import sys
import time
from html import escape
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from cavsumo.batch.sentences import many
from cavsumo.batch.tally import Tally


class Progress:
    """Progress display: episodes, rate, time left, and results; a context manager.

    Args:
        total: largest number of episodes.
        done: number of those played before.
    """

    def __init__(self, total: int, quiet: bool, done: int = 0) -> None:
        self.total, self.done, self.before = total, done, done
        self._begun, self._quiet = time.monotonic(), quiet
        terminal = sys.stderr.isatty()
        self._notebook = None if quiet or not in_notebook() else _NotebookBar()
        self._lines = not (quiet or terminal or self._notebook)
        self._bar = Bar(
            TextColumn("episodes"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.description}"),
            console=Console(stderr=True),
            disable=bool(quiet or self._notebook or not terminal),
            transient=True,
        )

    def __enter__(self) -> Progress:
        self._bar.start()
        self._task = self._bar.add_task("", total=self.total, completed=self.done)
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()
        if self._notebook is not None:
            self._notebook.clear()

    def say(self, line: str) -> None:
        """Print a line beside the progress, unless that is not shown."""
        if not self._quiet:
            self._bar.console.print(line, markup=False, highlight=False, soft_wrap=True)

    def update(self, tally: Tally) -> None:
        """One more episode was played."""
        self.done += 1
        rate = (self.done - self.before) / max(1e-9, time.monotonic() - self._begun)
        said = f"{rate:.1f}/s, {_found(tally)}"
        self._bar.update(self._task, advance=1, description=said)
        left = _duration((self.total - self.done) / rate)
        line = f"{self.done}/{self.total} episodes, {left} left, {said}"
        if self._notebook is not None:
            self._notebook.show(self.done, self.total, line)
        if self._lines and self._at_a_tenth():
            print(line, file=sys.stderr)

    def _at_a_tenth(self) -> bool:
        """Whether a tenth of the whole has just been completed."""
        return self.done * 10 // self.total > (self.done - 1) * 10 // self.total


class _NotebookBar:
    """A bar below the running cell, by IPython alone, because rich needs ipywidgets for one."""

    EVERY_S = 0.1  # of real time, it is drawn anew

    def __init__(self) -> None:
        self._handle: Any = None
        self._drawn = -math.inf

    def show(self, done: int, total: int, line: str) -> None:
        """Draw it, unless it was drawn just now."""
        if time.monotonic() - self._drawn >= self.EVERY_S:
            self._drawn = time.monotonic()
            self._draw(f'<progress value="{done}" max="{total}"></progress> {escape(line)}')

    def clear(self) -> None:
        """Remove it."""
        if self._handle is not None:
            self._draw("")

    def _draw(self, text: str) -> None:
        from IPython.display import HTML, display

        if self._handle is None:
            self._handle = display(HTML(text), display_id=True)
        else:
            self._handle.update(HTML(text))


def _found(tally: Tally) -> str:
    """The results so far."""
    found = tally.all
    judged = bool(found.preventable or found.unpreventable)
    failures = (found.preventable, "preventable failure") if judged else (found.failures, "failure")
    said = f"{many(found.tests, 'test')}, {many(*failures)}"
    return f"{said}, {many(found.errors, 'error')}" if found.errors else said


def _duration(seconds: float) -> str:
    """Minutes and seconds, hours if there are any."""
    minutes, s = divmod(round(seconds), 60)
    hours, m = divmod(minutes, 60)
    return f"{hours}:{m:02}:{s:02}" if hours else f"{m}:{s:02}"


def is_shown() -> bool:
    """Whether there is a bar: on a terminal or in a notebook."""
    return sys.stderr.isatty() or in_notebook()


def in_notebook() -> bool:
    """Whether this process is the kernel of a notebook."""
    loaded = sys.modules.get("IPython")
    shell = loaded.get_ipython() if loaded else None
    return getattr(shell, "kernel", None) is not None
