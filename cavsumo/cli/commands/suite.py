"""``cavsumo suite``: a published catalogue of tests, played."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cavsumo.batch.ended import Ended
from cavsumo.batch.manner import Manner, Means
from cavsumo.batch.planned import PlannedBatch
from cavsumo.cli.commands.run import run_study
from cavsumo.cli.steps import say_written
from cavsumo.report.pages.suite.page import write_suite_page
from cavsumo.report.suite_results import cases_in, suite_table, told_of


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
