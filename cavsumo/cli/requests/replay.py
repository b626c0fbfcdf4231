"""Options of the command replay, checked before heavy imports."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from cavsumo.cli.requests.files import check_folder
from cavsumo.errors import InputError, ResultsError
from cavsumo.kept.names import CAVTEST
from cavsumo.results.reading import read_manifest
from cavsumo.results.trace_file import is_trace


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


def check_replay(file: Path, wanted: ReplayOptions) -> None:
    """Refuse wrong numbers, names and files."""
    for option, output in (("--html", wanted.html), ("--fcd", wanted.fcd)):
        if output is not None:
            check_folder(option, output)
    kept = file.suffix == CAVTEST
    if not is_trace(file) and not kept:
        if wanted.run is None:
            raise InputError(f"replay: which run of {str(file)!r}? name its number")
        read_manifest(file)
        return
    if wanted.run is not None:
        what = "a kept test" if kept else "the trace"
        raise InputError(f"replay: {str(file)!r} is {what} of one episode; no run is named")
    if kept and (wanted.net or wanted.routes):
        raise InputError(f"replay: {str(file)!r} has its network in it; neither is named")
    try:
        file.open("rb").close()
    except OSError as error:
        sort = "test" if kept else "trace"
        raise ResultsError(f"{sort} {str(file)!r}: cannot be read: {error.strerror}") from error
