"""``cavsumo replay``: a recorded episode once more, compared frame by frame, bit for bit."""

from __future__ import annotations

import sys
from pathlib import Path

from cavsumo.batch.located import located
from cavsumo.batch.playback import NOT_PLAYED_BACK, for_playback, played_back
from cavsumo.batch.prepared import PreparedBatch, manifest
from cavsumo.batch.replay import (
    Record,
    compare,
    prepared_again,
    recorded,
    recorded_alone,
    replayed,
)
from cavsumo.batch.shown import shown_site
from cavsumo.batch.worker import Worker
from cavsumo.cli.requests.replay import TRACE, ReplayOptions
from cavsumo.errors import Exit, InputError
from cavsumo.interop.fcd import write_fcd
from cavsumo.network.site import Site
from cavsumo.results.provenance import changes
from cavsumo.results.traces import Trace


def replay(file: Path, wanted: ReplayOptions) -> int:
    """Play an episode again and show it; raises DivergenceError where it first differs."""
    if wanted.gui:
        from cavsumo.interop.gui import check_gui

        check_gui(wanted.delay)
    if wanted.playback and wanted.recorded:
        raise InputError("replay: --recorded plays nothing and --playback plays; name one of them")
    found = _found(file, wanted)
    record = for_playback(found) if wanted.playback else found
    if not wanted.recorded or wanted.shown:
        record = located(record, wanted.net, wanted.routes, shown=wanted.recorded)
    if wanted.recorded:
        trace: Trace | None = _recorded_trace(record)
        site = shown_site(record.plan, trace) if wanted.shown else None
    elif wanted.playback:
        trace, site = record.trace, _played_back(record)
    else:
        trace, site = _played(record)
    if wanted.shown and trace is None:
        raise InputError(f"replay: run {record.run} ended in an error, there is nothing to show")
    if trace is not None and site is not None:
        _show(site, found, trace, wanted)
    return Exit.OK


def _found(file: Path, wanted: ReplayOptions) -> Record:
    """The episode that is meant."""
    allowed = None if wanted.trust else ()
    if file.suffix == TRACE:
        return recorded_alone(file, allowed, anew=not wanted.playback)
    assert wanted.run is not None
    return recorded(file, wanted.run, allowed)


def _recorded_trace(record: Record) -> Trace:
    """The recorded trace."""
    if record.trace is None:
        raise InputError(f"--recorded: no trace was kept of run {record.run}; it must be played")
    print(f"run {record.run} ({record.row['agent']}): {record.row['outcome']}, as recorded")
    return record.trace


def _played(record: Record) -> tuple[Trace | None, Site]:
    """The trace of the episode played again, None where an error left none; and where it was."""
    prepared = _prepared(record)
    with Worker(prepared) as worker:
        again = replayed(worker, record)
    compare(record, again)
    _say(record, "the same")
    return again.trace, prepared.site


def _played_back(record: Record) -> Site:
    """Play an episode back; where it was."""
    prepared = _prepared(record)
    with Worker(prepared) as worker:
        again = played_back(worker, record)
    compare(record, again, NOT_PLAYED_BACK)
    _say(record, "the same, played back")
    return prepared.site


def _prepared(record: Record) -> PreparedBatch:
    """The prepared batch of a record; stderr names the changes since it was recorded."""
    prepared = prepared_again(record)
    for change in changes(record.origin, manifest(prepared)):
        print(f"cavsumo: {change}", file=sys.stderr)
    return prepared


def _say(record: Record, how: str) -> None:
    """One line of what was compared."""
    frames = record.trace.frames if record.trace is not None else None
    compared = f"{len(frames)} frames" if frames is not None else "its row (no trace was kept)"
    row = record.row
    print(f"run {record.run} ({row['agent']}): {row['outcome']}, {compared}: {how}")


def _show(site: Site, record: Record, trace: Trace, wanted: ReplayOptions) -> None:
    """Write and show the requested output."""
    if wanted.fcd is not None:
        write_fcd(trace, wanted.fcd)
    if wanted.html is not None:
        from cavsumo.report.pages.replay.page import write_page

        write_page(record, trace, site, wanted.html)
    if wanted.gui:
        from cavsumo.interop.gui import show

        show(trace, record.plan.scenario, site, wanted.delay)
