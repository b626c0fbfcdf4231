"""A report in files, by their formats; all figures are computed before a file is written."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from cavsumo.errors import InputError
from cavsumo.report.analysis import Report, analyse
from cavsumo.report.formats import FORMATS
from cavsumo.report.junit import junit
from cavsumo.report.order import ReportOptions, check_report


def write_report_files(results: Sequence[Path], wanted: ReportOptions) -> str:
    """Write the files of a report; returns its text if that goes into none of them.

    Raises InputError; nothing is written when anything is wrong.
    """
    check_report(results, wanted)
    write_page = _page_writer() if wanted.html is not None else None
    found = analyse(results, wanted.by)
    text = FORMATS[wanted.format](found)
    xml = junit(found.evidence) if wanted.junit is not None else ""
    if write_page is not None and wanted.html is not None:
        for problem in write_page(found, wanted.html, wanted.replays):
            print(f"cavsumo: --html: {problem}", file=sys.stderr)
    if wanted.junit is not None:
        _write("--junit", wanted.junit, xml)
    if wanted.output is not None:
        _write("--output", wanted.output, text)
        return ""
    return text


def _page_writer() -> Callable[[Report, Path, int], list[str]]:
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


def _write(option: str, file: Path, text: str) -> None:
    """Write a file."""
    try:
        file.write_text(text, encoding="utf-8", errors="backslashreplace")
    except OSError as error:
        raise InputError(f"{option} {str(file)!r}: cannot be written: {error.strerror}") from error
