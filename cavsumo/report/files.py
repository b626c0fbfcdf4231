"""A report in files, by their formats; all figures are computed before a file is written."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cavsumo.errors import InputError
from cavsumo.report.analysis import analyse
from cavsumo.report.formats import FORMATS
from cavsumo.report.junit import junit
from cavsumo.report.order import ReportOptions, check_report


def write_report_files(results: Sequence[Path], wanted: ReportOptions) -> str:
    """Write the files of a report; returns its text if that goes into none of them.

    Raises InputError; nothing is written when anything is wrong.
    """
    check_report(results, wanted)
    found = analyse(results, wanted.by)
    text = FORMATS[wanted.format](found)
    xml = junit(found.evidence) if wanted.junit is not None else ""
    if wanted.html is not None:
        from cavsumo.report.pages.report.document import write_report

        write_report(found, wanted.html, wanted.replays)
    if wanted.junit is not None:
        _write("--junit", wanted.junit, xml)
    if wanted.output is not None:
        _write("--output", wanted.output, text)
        return ""
    return text


def _write(option: str, file: Path, text: str) -> None:
    """Write a file."""
    try:
        file.write_text(text, encoding="utf-8", errors="backslashreplace")
    except OSError as error:
        raise InputError(f"{option} {str(file)!r}: cannot be written: {error.strerror}") from error
