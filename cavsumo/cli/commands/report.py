"""``cavsumo report``: the evidence of one or several results files."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from cavsumo.errors import Exit
from cavsumo.report.files import write_report_files
from cavsumo.report.order import ReportOptions


def report(results: Sequence[Path], wanted: ReportOptions) -> int:
    """Read, compute and print; no file is written after an error."""
    sys.stdout.write(write_report_files(results, wanted))
    return Exit.OK
