"""``cavsumo export``: a recorded episode in a format of others."""

from __future__ import annotations

import sys

from cavsumo.batch.located import located
from cavsumo.batch.sentences import many
from cavsumo.cli.commands.kept import found_episode
from cavsumo.cli.requests.kept import KeepOptions
from cavsumo.cli.steps import SlowSteps, say_written
from cavsumo.errors import Exit, InputError
from cavsumo.interop.openscenario import XODR, XOSC, write_openscenario
from cavsumo.kept.cavtest import is_cavtest


def export(wanted: KeepOptions) -> int:
    """Write an episode as OpenSCENARIO with OpenDRIVE; it is not played."""
    assert wanted.output is not None
    record = found_episode(wanted)
    if not is_cavtest(wanted.results):
        record = located(record, wanted.net, wanted.routes, shown=True)
    if record.trace is None:
        raise InputError(f"export: no trace was kept of run {record.run}")
    with SlowSteps() as steps:
        steps.begin(f"exporting run {record.run}")
        left = write_openscenario(record.trace, record.plan.scenario.net_file, wanted.output)
    if left:
        print(
            f"cavsumo: {many(len(left), 'body')} that enter late or leave early are left out: "
            f"{', '.join(left[:6])}".replace("bodys", "bodies"),
            file=sys.stderr,
        )
    say_written([wanted.output / XOSC, wanted.output / XODR])
    return Exit.OK
