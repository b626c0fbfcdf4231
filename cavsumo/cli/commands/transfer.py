"""``cavsumo transfer``: kept tests on other networks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cavsumo.batch.ended import Ended
from cavsumo.batch.manner import Manner, Means
from cavsumo.batch.planned import planned
from cavsumo.cli.commands.run import run_study
from cavsumo.cli.steps import SlowSteps
from cavsumo.kept.transfer import transfer_parts
from cavsumo.kept.transfer_order import TransferOrder
from cavsumo.kept.transferred import transferred
from cavsumo.report.transfers import transfer_table


def transfer(order: TransferOrder, output: Path, means: Means, manner: Manner) -> int:
    """Play tests on other networks as any batches; returns the exit status."""
    with SlowSteps(quiet=manner.quiet) as steps:
        steps.begin("looking for places where the tests fit")
        parts = transfer_parts(order)

    def head(ended: Sequence[Ended]) -> str:
        return transfer_table(transferred(parts, [one.csv_file for one in ended]))

    return run_study(planned(parts.parts, output, manner), means, manner, head)
