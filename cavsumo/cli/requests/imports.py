"""Options of the command import, checked before heavy imports."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from cavsumo.cli.requests.files import check_folder
from cavsumo.errors import InputError
from cavsumo.results.trace_file import PACKED


@dataclass(frozen=True)
class ImportEpisodeOptions:
    """Options of import.

    Attributes:
        file: an exported episode.
        output: the trace to write.
        net: where its network is, if not beside the file.
        trust: use an assertion that only the file names.
    """

    file: Path
    output: Path
    net: Path | None = None
    trust: bool = False


def check_import(wanted: ImportEpisodeOptions) -> None:
    """Refuse files that are not there, and other endings."""
    if not wanted.file.is_file():
        raise InputError(f"import: no such file: {str(wanted.file)!r}")
    if not wanted.output.name.endswith(PACKED):
        raise InputError(f"--output {str(wanted.output)!r}: expected a name that ends in {PACKED}")
    check_folder("--output", wanted.output)
