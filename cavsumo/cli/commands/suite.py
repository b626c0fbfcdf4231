"""``cavsumo suite``: a published catalogue of tests, played or listed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from cavsumo.batch.ended import Ended
from cavsumo.batch.manner import Manner, Means
from cavsumo.batch.planned import PlannedBatch
from cavsumo.cli.commands.run import run_study
from cavsumo.cli.steps import say_written
from cavsumo.report.pages.suite.page import write_suite_page
from cavsumo.report.suite_results import cases_in, suite_table, told_of
from cavsumo.suites.cells import all_cells
from cavsumo.suites.files import read_suite, suite_file, suite_names


def play_suite(
    batches: Sequence[PlannedBatch], means: Means, manner: Manner, page: Path | None
) -> int:
    """Play a suite as any batch, with a table of its tests; returns the exit status."""

    def head(ended: Sequence[Ended]) -> str:
        return suite_table(cases_in(ended[0].csv_file))

    status = run_study(batches, means, manner, head)
    if page is not None:
        (batch,) = batches
        write_suite_page(told_of(batch.output), cases_in(batch.output), page)
        say_written([page], quiet=manner.quiet)
    return status


def listing(name: str | None) -> str:
    """One line for each suite, or for each test of one with the number of its cells."""
    if name is None:
        lines = {one: read_suite(suite_file(one)).title for one in suite_names()}
        return _columns([[*line] for line in lines.items()])
    suite = read_suite(suite_file(name))
    count = Counter((cell.test.name, cell.extended) for cell in all_cells(suite))
    rows = [["test", "standard", "extended", ""]]
    rows += [
        [test.name, str(count[test.name, False]), str(count[test.name, True]), test.title]
        for test in suite.tests
    ]
    head = [f"{name}: {suite.title}", suite.source, suite.note]
    return "\n".join([*filter(None, head), _columns(rows)])


def _columns(rows: Sequence[Sequence[str]]) -> str:
    """Columns as wide as needed."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(f"{word:{width}}" for word, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )
