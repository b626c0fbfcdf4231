"""``cavsumo export``: a recorded episode in a format of others."""

from __future__ import annotations

from pathlib import Path

from cavsumo.batch.located import located
from cavsumo.batch.shown import shown_site
from cavsumo.cli.commands.kept import found_episode
from cavsumo.cli.requests.kept import KeepOptions
from cavsumo.cli.steps import SlowSteps, say_written
from cavsumo.errors import Exit, InputError
from cavsumo.interop.commonroad import XML, write_commonroad
from cavsumo.interop.opendrive import XODR
from cavsumo.interop.openscenario import XOSC, ExportPlace, write_openscenario
from cavsumo.kept.cavtest import is_cavtest
from cavsumo.results.traces import Trace


def export(wanted: KeepOptions) -> int:
    """Write an episode in a format of others; it is not played."""
    assert wanted.output is not None
    record = found_episode(wanted)
    if not is_cavtest(wanted.results):
        record = located(record, wanted.net, wanted.routes, shown=True)
    if record.trace is None:
        raise InputError(f"export: no trace was kept of run {record.run}")
    scenario = record.plan.scenario
    with SlowSteps() as steps:
        steps.begin(f"exporting run {record.run}")
        route = shown_site(record.plan, record.trace).route
        place = ExportPlace(scenario.net_file, route.path, route.edges, scenario.end)
        names = _written(record.trace, place, wanted.output, wanted)
    say_written([wanted.output / name for name in names])
    return Exit.OK


def _written(trace: Trace, place: ExportPlace, folder: Path, wanted: KeepOptions) -> list[str]:
    """Write the files of a format; their names."""
    if wanted.to == "commonroad":
        write_commonroad(trace, place, folder, wanted.way)
        return [XML]
    write_openscenario(trace, place, folder, wanted.way)
    return [XOSC, XODR]
