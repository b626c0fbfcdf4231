"""A report in files, by their formats; everything is computed before anything is written."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from cavsumo.errors import InputError
from cavsumo.report.analysis import Report, analyse
from cavsumo.report.formats import FORMATS
from cavsumo.report.junit import junit


@dataclass(frozen=True)
class ReportOptions:
    """What a report is asked for.

    Attributes:
        by: the column whose values are told apart.
        format: of what is printed, or written to output.
        output, junit, html: files to write.
        replays: how many failures the page shows as pages of their own.
    """

    by: str = "agent"
    format: str = "table"
    output: Path | None = None
    junit: Path | None = None
    html: Path | None = None
    replays: int = 20


def write_report_files(results: Sequence[Path], wanted: ReportOptions) -> str:
    """Write the files of a report; returns its text if that goes into none of them.

    Raises InputError; nothing is written when anything is wrong.
    """
    for option in ("output", "junit", "html"):
        _check_output(f"--{option}", getattr(wanted, option), results)
    if wanted.replays < 0:
        raise InputError(f"--replays: expected at least 0, got {wanted.replays}")
    write_page = _page_writer() if wanted.html is not None else None
    found = analyse(results, wanted.by)
    text = FORMATS[wanted.format](found)
    xml = junit(found.evidence) if wanted.junit is not None else ""
    if write_page is not None and wanted.html is not None:
        write_page(found, wanted.html, wanted.replays)
    if wanted.junit is not None:
        _write("--junit", wanted.junit, xml)
    if wanted.output is not None:
        _write("--output", wanted.output, text)
        return ""
    return text


def _page_writer() -> Callable[[Report, Path, int], None]:
    """The function that writes the page, when what draws its plots is installed."""
    try:
        from cavsumo.report.pages.report.document import write_report
    except ImportError as error:
        if (error.name or "").partition(".")[0] != "matplotlib":
            raise
        raise InputError(
            "--html needs the package matplotlib: pip install 'cavsumo[plot]'"
        ) from None
    return write_report


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


def _write(option: str, file: Path, text: str) -> None:
    """Write a file."""
    try:
        file.write_text(text, encoding="utf-8", errors="backslashreplace")
    except OSError as error:
        raise InputError(f"{option} {str(file)!r}: cannot be written: {error.strerror}") from error
