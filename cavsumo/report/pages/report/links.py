"""Runs worth looking at: failures, preventable ones and one of each cell first, and passed tests.

The first of them are written as pages of their own, from their traces, without playing them again.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas

from cavsumo.batch.replay import Record
from cavsumo.batch.shown import shown_site
from cavsumo.errors import InputError
from cavsumo.report.analysis import Report
from cavsumo.report.distinct import JUDGED
from cavsumo.report.load import Batch
from cavsumo.report.order import Tell
from cavsumo.report.pages.replay.page import write_page
from cavsumo.report.pages.report.scenes import BatchPlace
from cavsumo.results.failures import ORDER, failure_kind
from cavsumo.results.reading import inside, whole_lines
from cavsumo.results.recorded_plan import plan_in
from cavsumo.results.traces import read_trace

FAILURES = 50  # are listed at most, or as many as there are pages
TESTS = 10  # passed tests are listed if there are no pages


@dataclass(frozen=True)
class LinkedRun:
    """A run for inspection.

    Attributes:
        index: of its row in the evidence.
        batch, run, agent, tester, setting: its identity.
        failed: whether the ego failed.
        kind: of failure, empty for none (``failures.failure_kind``).
        time, speed: when it was triggered or failed [s]; closing speed then [m/s], None if unknown.
        alike: failures of its kind, itself included; None unless it is the first of them.
        command: the command that replays it.
        page: the name of its page, empty without one.
    """

    index: int
    batch: int
    run: int
    agent: str
    tester: str
    setting: str
    failed: bool
    kind: str
    time: float
    speed: float | None
    alike: int | None
    command: str
    page: str = ""


def chosen(report: Report, pages: int) -> tuple[list[LinkedRun], list[LinkedRun]]:
    """Failures and passed tests to be listed, those to be shown as pages first."""
    rows = report.evidence.rows
    failures, tests = (rows[rows["outcome"] == what] for what in ("violated", "held"))
    alike = {(cell.file, cell.run): cell.count for cell in report.failures}
    firsts = {key: rank for rank, key in enumerate(alike)}
    keys = list(zip(failures["file"], failures["run"], strict=True))
    told = zip(*(failures[name] for name in JUDGED), strict=True)
    kinds = [ORDER.index(failure_kind(dict(zip(JUDGED, cells, strict=True)))) for cells in told]
    order = sorted(range(len(keys)), key=lambda i: (kinds[i], firsts.get(keys[i], len(firsts)), i))
    picked = failures.iloc[order[: max(FAILURES, pages)]]
    spread = np.linspace(0, len(tests) - 1, min(len(tests), pages // 2 or TESTS))
    return (
        _looks(report, picked, alike),
        _looks(report, tests.iloc[np.round(spread).astype(int)], {}),
    )


def _looks(
    report: Report,
    rows: pandas.DataFrame,
    alike: Mapping[tuple[str, int], int],
) -> list[LinkedRun]:
    """Rows as runs for inspection."""
    found = []
    for row in rows.itertuples():
        test, failed = report.tests[int(row.Index)], row.outcome == "violated"
        event = test.impact if failed and test.impact is not None else test.trigger
        run = int(row.run)
        look = LinkedRun(
            index=int(row.Index),
            batch=int(row.batch),
            run=run,
            agent=row.agent,
            tester=row.tester,
            setting=next(g.setting for g in report.groups if row.Index in g.rows.index),
            failed=failed,
            kind=failure_kind(row._asdict()),
            time=float(row.violation_time_s if failed else row.trigger_time_s),
            speed=event.speed,
            alike=alike.get((row.file, run)),
            command=f"cavsumo replay {shlex.quote(row.file)} {run}",
        )
        found.append(look)
    return found


def with_pages(
    looks: Sequence[LinkedRun], most: int, report: Report, scenes: Sequence[BatchPlace]
) -> list[LinkedRun]:
    """The same, the first of those that can be shown with names for their pages.

    A page needs the trace, and the network as it was.
    """
    traced, several = report.evidence.rows["trace"], len(report.evidence.batches) > 1
    shown = [scene for scene in scenes if scene.site is not None]
    can = [
        look.index
        for look in looks
        if traced[look.index] and any(scene.has(look.batch, look.run) for scene in shown)
    ][:most]
    return [
        replace(look, page=_name(look, several)) if look.index in can else look for look in looks
    ]


def unshown(
    looks: Sequence[LinkedRun], most: int, report: Report, scenes: Sequence[BatchPlace]
) -> list[str]:
    """Sentences that say why listed runs have no pages although there is room for more."""
    if most == 0 or sum(1 for look in looks if look.page) >= min(most, len(looks)):
        return []
    traced, listed = report.evidence.rows["trace"], {(look.batch, look.run) for look in looks}
    lacking = [scene for scene in scenes if scene.site is None]
    bare = [scene for scene in lacking if any(scene.has(*one) for one in listed)]
    said = [f"No replay pages, for lack of the network: {scene.problem}" for scene in bare]
    missing = sum(1 for look in looks[:most] if not traced[look.index])
    if missing:
        said.append(f"No replay pages of {missing} of the listed runs: no trace of them was kept")
    return said


def _name(look: LinkedRun, several: bool) -> str:
    """The name of the page of a run."""
    return f"{f'batch{look.batch + 1}-' if several else ''}run{look.run:06d}.html"


def write_pages(
    looks: Sequence[LinkedRun],
    batches: Sequence[Batch],
    scenes: Sequence[BatchPlace],
    folder: Path,
    tell: Tell,
) -> int:
    """Write the pages of the runs that have a page name into a folder; returns their number.

    Raises InputError.
    """
    wanted = [look for look in looks if look.page]
    if not wanted:
        return 0
    written = 0
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError(f"--html: {str(folder)!r}: {error.strerror}") from error
    for i in sorted({look.batch for look in wanted}):
        here = {str(look.run): look for look in wanted if look.batch == i}
        for _, row in whole_lines(batches[i].csv_file):
            if row is not None and row["run"] in here:
                written += 1
                tell("writing replay pages", f"{written} of {len(wanted)}")
                scene = next(scene for scene in scenes if scene.has(i, int(row["run"])))
                _write_page(here[row["run"]], row, batches[i], scene, folder)
    return written


def _write_page(
    look: LinkedRun, row: Mapping[str, str], batch: Batch, scene: BatchPlace, folder: Path
) -> None:
    """Write the page of a run."""
    assert scene.plan is not None
    assert scene.site is not None
    trace = read_trace(inside(batch.csv_file, row["trace"]))
    scenario, site = scene.plan.scenario, scene.site
    if batch.plan.suite is not None:  # each case has a script of its own
        own = plan_in(trace.head, f"trace of run {look.run}")
        scenario = own.scenario.placed(scenario.places)
        site = shown_site(own.model_copy(update={"scenario": scenario}), trace)
    plan = batch.plan.model_copy(update={"scenario": scenario, "suite": None})
    write_page(
        Record(plan, row, trace, batch.manifest, batch.csv_file), trace, site, folder / look.page
    )
