"""``cavsumo report``: the evidence of one or several results files."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from cavsumo.errors import Exit, InputError
from cavsumo.report.analysis import analyse
from cavsumo.report.formats import FORMATS
from cavsumo.report.junit import junit


def report(
    results: Sequence[Path], by: str, format: str, output: Path | None, junit_file: Path | None
) -> int:
    """Read, compute, and say it; nothing is written when anything is wrong."""
    for option, file in (("--output", output), ("--junit", junit_file)):
        _check_output(option, file, results)
    found = analyse(results, by)
    text = FORMATS[format](found)
    xml = junit(found.evidence) if junit_file is not None else ""
    if junit_file is not None:
        _write("--junit", junit_file, xml)
    if output is not None:
        _write("--output", output, text)
    else:
        sys.stdout.write(text)
    return Exit.OK


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
