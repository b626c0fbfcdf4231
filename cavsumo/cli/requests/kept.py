"""Options of the commands minimise, keep and export, checked before heavy imports."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from cavsumo.cli.requests.files import check_folder
from cavsumo.errors import InputError
from cavsumo.interop.folders import check_place
from cavsumo.kept.names import CAVTEST
from cavsumo.results.reading import read_manifest
from cavsumo.results.trace_file import is_trace


@dataclass(frozen=True)
class KeepOptions:
    """Options of both commands.

    Attributes:
        results: the CSV of a batch, a trace, or a kept test.
        run: the number of the episode in results; None for a trace or a kept test.
        output: the file of the test; None writes none.
        net, routes: where the network and the routes are, if not where they were.
        trust: play it even if that runs, imports or connects to what only the file names.
        html: a page to write.
        replays: the most that are played.
        quiet: no progress.
        to, way: the format of an export, and whether as recorded or as a test.
    """

    results: Path
    run: int | None = None
    output: Path | None = None
    net: Path | None = None
    routes: Path | None = None
    trust: bool = False
    html: Path | None = None
    replays: int = 1000
    quiet: bool = False
    to: str = "openscenario"
    way: str = "recorded"


def check_kept(command: str, wanted: KeepOptions) -> None:
    """Refuse wrong numbers, names and files."""
    if wanted.replays < 1:
        raise InputError(f"{command}: --replays: expected at least 1, got {wanted.replays}")
    if wanted.html is not None:
        check_folder("--html", wanted.html)
    if wanted.output is not None:
        if wanted.output.suffix != CAVTEST:
            raise InputError(
                f"--output {str(wanted.output)!r}: expected a name that ends in {CAVTEST}"
            )
        check_folder("--output", wanted.output)
    _check_episode(command, wanted.results, wanted.run)


def check_export(wanted: KeepOptions) -> None:
    """Refuse wrong names and files."""
    assert wanted.output is not None
    check_place(wanted.output)
    if wanted.to == "openscenario" and find_spec("scenariogeneration") is None:
        raise InputError("export: needs scenariogeneration: pip install 'cavsumo[export]'")
    _check_episode("export", wanted.results, wanted.run)


def _check_episode(command: str, file: Path, run: int | None) -> None:
    """Refuse a file that is not there, and a number that is missing or too much."""
    if is_trace(file) or file.suffix == CAVTEST:
        if run is not None:
            raise InputError(f"{command}: {str(file)!r} is one episode; no run is named")
        if not file.is_file():
            raise InputError(f"{command}: no such file: {str(file)!r}")
        return
    if run is None:
        raise InputError(f"{command}: which run of {str(file)!r}? name its number")
    read_manifest(file)
