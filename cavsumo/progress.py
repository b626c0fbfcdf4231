"""Progress on stderr: a bar on a terminal, a plain line every tenth elsewhere."""

from __future__ import annotations

import sys
from collections import Counter

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from cavsumo.outcomes import Row


class Progress:
    """Counts episodes, tests and failures; a context manager."""

    def __init__(self, total: int, quiet: bool) -> None:
        self.total, self.done = total, 0
        self.counts: Counter[str] = Counter()
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
        self._task = self._bar.add_task("", total=self.total)
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def update(self, row: Row) -> None:
        """Count one more episode."""
        self.done += 1
        self.counts[row["outcome"]] += 1
        self._bar.update(self._task, advance=1, description=self._found())
        tenth = max(1, self.total // 10)
        if self._lines and (self.done % tenth == 0 or self.done == self.total):
            print(f"{self.done}/{self.total} episodes, {self._found()}", file=sys.stderr)

    def _found(self) -> str:
        """What was found so far."""
        tests = self.counts["violated"] + self.counts["held"]
        found = f"{tests} tests, {self.counts['violated']} failures"
        errors = self.counts["error"]
        return f"{found}, {errors} errors" if errors else found
