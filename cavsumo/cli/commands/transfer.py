"""``cavsumo transfer``: kept tests on other networks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cavsumo.batch.ended import Ended
from cavsumo.batch.manner import Manner, Means
from cavsumo.batch.planned import planned
from cavsumo.cli.commands.run import run_study
from cavsumo.cli.requests.transfer import TransferOptions
from cavsumo.cli.steps import SlowSteps
from cavsumo.kept.transfer import TransferOrder, transfer_parts
from cavsumo.kept.transfer_form import FORMS
from cavsumo.kept.transferred import table, transferred


def transfer(wanted: TransferOptions, output: Path, means: Means, manner: Manner) -> int:
    """Play tests on other networks as any batches; returns the exit status."""
    order = TransferOrder(
        wanted.tests,
        wanted.net,
        wanted.ego,
        wanted.ego_param,
        wanted.places,
        wanted.seeds,
        wanted.seed,
        FORMS if wanted.form == "both" else (wanted.form,),
        wanted.trust,
    )
    with SlowSteps(quiet=manner.quiet) as steps:
        steps.begin("looking for places where the tests fit")
        parts = transfer_parts(order)

    def head(ended: Sequence[Ended]) -> str:
        return table(transferred(parts, [one.csv_file for one in ended]))

    return run_study(planned(parts.parts, output, manner), means, manner, head)
