"""``cavsumo replay``: a recorded episode once more, compared frame by frame, bit for bit."""

from __future__ import annotations

import sys
from dataclasses import dataclass
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
from cavsumo.errors import Exit, InputError
from cavsumo.interop.fcd import write_fcd
from cavsumo.network.site import Site
from cavsumo.results.provenance import changes
from cavsumo.results.traces import Trace

TRACE = ".jsonl"  # how the name of a trace ends


@dataclass(frozen=True)
class ReplayOptions:
    """Options of the command.

    Attributes:
        run: number of the episode in results; None when a trace is given.
        net, routes: where the network and the routes are, if not where they were.
        recorded: take the trace as it is and play nothing.
        playback: play its recorded actions and traffic instead of asking its agents.
        trust: play it even if that runs, imports or connects to what only the file names.
        html, fcd: files to write.
        gui: show it in sumo-gui, with so many milliseconds a timestep.
    """

    run: int | None = None
    net: Path | None = None
    routes: Path | None = None
    recorded: bool = False
    playback: bool = False
    trust: bool = False
    html: Path | None = None
    fcd: Path | None = None
    gui: bool = False
    delay: float | None = None

    @property
    def shown(self) -> bool:
        """Whether the trace is needed."""
        return bool(self.html or self.fcd or self.gui)


def replay(file: Path, wanted: ReplayOptions = ReplayOptions()) -> int:
    """Play an episode again and show it; raises DivergenceError where it first differs."""
    for option, output in (("--html", wanted.html), ("--fcd", wanted.fcd)):
        if output is not None and not output.parent.is_dir():
            raise InputError(f"{option} {str(output)!r}: no such folder {str(output.parent)!r}")
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
        if wanted.run is not None:
            raise InputError(f"replay: {str(file)!r} is the trace of one episode; no run is named")
        return recorded_alone(file, allowed, anew=not wanted.playback)
    if wanted.run is None:
        raise InputError(f"replay: which run of {str(file)!r}? name its number")
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
