"""A report in files, by their formats; all figures are computed before a file is written."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from cavsumo.errors import InputError
from cavsumo.report.analysis import analyse
from cavsumo.report.formats import FORMATS
from cavsumo.report.junit import junit
from cavsumo.report.order import ReportOptions, Tell, check_report, untold


class WrittenReport(NamedTuple):
    """A report that was written.

    Attributes:
        text: of the report; empty if it went into a file.
        files: names of the files and folders that were written.
        problems: sentences that say which pages of replays cannot be made, and why.
    """

    text: str
    files: Sequence[str]
    problems: Sequence[str]


def write_report_files(
    results: Sequence[Path], wanted: ReportOptions, tell: Tell = untold
) -> WrittenReport:
    """Write the files of a report.

    Raises InputError; nothing is written when anything is wrong.
    """
    check_report(results, wanted)
    tell("computing the report", "")
    found = analyse(results, wanted.by)
    text = FORMATS[wanted.format](found)
    xml = junit(found.evidence) if wanted.junit is not None else ""
    files: list[str] = []
    problems: list[str] = []
    if wanted.html is not None:
        from cavsumo.report.pages.report.document import write_report

        page = write_report(found, wanted.html, wanted.replays, tell)
        files += page.files
        problems += page.problems
    texts = ("--junit", wanted.junit, xml), ("--output", wanted.output, text)
    for option, file, content in texts:
        if file is not None:
            _write(option, file, content)
            files.append(str(file))
    return WrittenReport(text if wanted.output is None else "", files, problems)


def _write(option: str, file: Path, text: str) -> None:
    """Write a file."""
    try:
        file.write_text(text, encoding="utf-8", errors="backslashreplace")
    except OSError as error:
        raise InputError(f"{option} {str(file)!r}: cannot be written: {error.strerror}") from error
