"""Progress on stderr: a bar on a terminal, a plain line every tenth elsewhere."""

from __future__ import annotations

import sys
import time

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from cavsumo.batch.sentences import many
from cavsumo.batch.tally import Tally


class Progress:
    """Episodes, rate, time left, and what was found; a context manager.

    Args:
        total: how many episodes there are at most.
        done: how many of them were played before.
    """

    def __init__(self, total: int, quiet: bool, done: int = 0) -> None:
        self.total, self.done, self.before = total, done, done
        self._begun = time.monotonic()
        terminal = sys.stderr.isatty()
        self._lines = not quiet and not terminal
        self._bar = Bar(
            TextColumn("episodes"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.description}"),
            console=Console(stderr=True),
            disable=quiet or not terminal,
            transient=True,
        )

    def __enter__(self) -> Progress:
        self._bar.start()
        self._task = self._bar.add_task("", total=self.total, completed=self.done)
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def update(self, tally: Tally) -> None:
        """One more episode was played."""
        self.done += 1
        rate = (self.done - self.before) / max(1e-9, time.monotonic() - self._begun)
        said = f"{rate:.1f}/s, {_found(tally)}"
        self._bar.update(self._task, advance=1, description=said)
        if self._lines and self._at_a_tenth():
            left = _duration((self.total - self.done) / rate)
            print(f"{self.done}/{self.total} episodes, {left} left, {said}", file=sys.stderr)

    def _at_a_tenth(self) -> bool:
        """Whether a tenth of the whole has just been completed."""
        return self.done * 10 // self.total > (self.done - 1) * 10 // self.total


def _found(tally: Tally) -> str:
    """What was found so far."""
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
