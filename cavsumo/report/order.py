"""Options of a report, checked before heavy imports."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from cavsumo.errors import InputError
from cavsumo.results.reading import read_manifest

Tell = Callable[[str, str], None]  # called with a step that begins, and how far it is


def untold(step: str, detail: str) -> None:
    """Tell nobody."""


@dataclass(frozen=True)
class ReportOptions:
    """The options of a report.

    Attributes:
        by: the column whose values are reported separately.
        format: of the text that is printed or written to output.
        output, junit, html: files to write.
        replays: number of failures with pages of their own.
    """

    by: str = "agent"
    format: str = "table"
    output: Path | None = None
    junit: Path | None = None
    html: Path | None = None
    replays: int = 20


def check_report(results: Sequence[Path], wanted: ReportOptions) -> None:
    """Refuse wrong numbers and files."""
    for option in ("output", "junit", "html"):
        _check_output(f"--{option}", getattr(wanted, option), results)
    if wanted.replays < 0:
        raise InputError(f"--replays: expected at least 0, got {wanted.replays}")
    for csv_file in results:
        read_manifest(csv_file)


def _check_output(option: str, file: Path | None, results: Sequence[Path]) -> None:
    """Refuse to write over the results or into nowhere."""
    if file is None:
        return
    if not file.parent.is_dir():
        raise InputError(f"{option} {str(file)!r}: no such folder {str(file.parent)!r}")
    own = [path for csv_file in results for path in (csv_file, csv_file.with_suffix(".json"))]
    if file.resolve() in [path.resolve() for path in own]:
        raise InputError(f"{option} {str(file)!r}: is one of the results")
    if file.is_dir():
        raise InputError(f"{option} {str(file)!r}: is a folder")
