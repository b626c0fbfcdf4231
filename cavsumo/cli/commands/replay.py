"""``cavsumo replay``: a recorded episode once more, compared frame by frame, bit for bit."""

from __future__ import annotations

import functools
import sys
from pathlib import Path

from cavsumo.batch.located import located
from cavsumo.batch.prepared import PreparedBatch, manifest
from cavsumo.batch.replay import Record, check_played, recorded, recorded_alone
from cavsumo.batch.replaying import play_again, play_back
from cavsumo.batch.shown import shown_site
from cavsumo.cli.requests.replay import ReplayOptions
from cavsumo.cli.steps import SlowSteps, say_written
from cavsumo.errors import Exit, InputError
from cavsumo.interop.fcd import write_fcd
from cavsumo.kept.cavtest import is_cavtest, read_cavtest
from cavsumo.network.site import Site
from cavsumo.results.provenance import changes
from cavsumo.results.trace_file import is_trace
from cavsumo.results.traces import Trace


def replay(file: Path, wanted: ReplayOptions) -> int:
    """Play an episode again and show it; raises DivergenceError where it first differs."""
    if wanted.gui:
        from cavsumo.interop.gui import check_gui

        check_gui(wanted.delay)
    if wanted.playback and wanted.recorded:
        raise InputError("replay: --recorded plays nothing and --playback plays; name one of them")
    with SlowSteps() as steps:
        record = _found(file, wanted)
        if not wanted.recorded:
            check_played(record)
        steps.begin(f"replaying run {record.run}")
        record, trace, site = _taken(record, wanted)
        if wanted.shown and trace is None:
            raise InputError(
                f"replay: run {record.run} ended in an error, there is nothing to show"
            )
        if trace is not None and site is not None:
            _write(site, record, trace, wanted)
    say_written([wanted.fcd, wanted.html])
    if wanted.gui and trace is not None and site is not None:
        from cavsumo.interop.gui import show

        show(trace, record.plan.scenario, site, wanted.delay)
    return Exit.OK


def _taken(record: Record, wanted: ReplayOptions) -> tuple[Record, Trace | None, Site | None]:
    """The episode as recorded, played back or played again: its record, trace and place.

    There is no trace after an error, and no place where nothing is shown.
    """
    kept = is_cavtest(record.file)  # it has its files in it
    there = functools.partial(located, net=wanted.net, routes=wanted.routes, shown=wanted.recorded)
    here = _as_it_is if kept else there
    if wanted.recorded:
        record = here(record) if wanted.shown else record
        trace: Trace | None = _recorded_trace(record)
        site = shown_site(record.plan, trace) if wanted.shown else None
    elif wanted.playback or kept:
        record, site = play_back(record, here, _say_changes)
        trace = record.trace
        _say(record, "the same, played back")
    else:
        record = here(record)
        trace, site = play_again(record, _say_changes)
        _say(record, "the same")
    return record, trace, site


def _as_it_is(record: Record) -> Record:
    """The record itself."""
    return record


def _found(file: Path, wanted: ReplayOptions) -> Record:
    """The episode that is meant."""
    allowed = None if wanted.trust else ()
    if is_cavtest(file):
        return read_cavtest(file, allowed).record
    if is_trace(file):
        anew = not (wanted.recorded or wanted.playback or wanted.shown)
        return recorded_alone(file, allowed, anew=anew)
    assert wanted.run is not None
    return recorded(file, wanted.run, allowed)


def _recorded_trace(record: Record) -> Trace:
    """The recorded trace."""
    if record.trace is None:
        raise InputError(f"--recorded: no trace was kept of run {record.run}; it must be played")
    print(f"run {record.run} ({record.row['agent']}): {record.row['outcome']}, as recorded")
    return record.trace


def _say_changes(record: Record, prepared: PreparedBatch) -> None:
    """Print on stderr what has changed since an episode was recorded."""
    for change in changes(record.origin, manifest(prepared)):
        print(f"cavsumo: {change}", file=sys.stderr)


def _say(record: Record, how: str) -> None:
    """One line of what was compared."""
    frames = record.trace.frames if record.trace is not None else None
    compared = f"{len(frames)} frames" if frames is not None else "its row (no trace was kept)"
    row = record.row
    print(f"run {record.run} ({row['agent']}): {row['outcome']}, {compared}: {how}")


def _write(site: Site, record: Record, trace: Trace, wanted: ReplayOptions) -> None:
    """Write the requested files."""
    if wanted.fcd is not None:
        write_fcd(trace, wanted.fcd)
    if wanted.html is not None:
        from cavsumo.report.pages.replay.page import write_page

        write_page(record, trace, site, wanted.html)
