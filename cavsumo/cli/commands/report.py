"""``cavsumo report``: the evidence of one or several results files."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from cavsumo.errors import Exit
from cavsumo.report.files import ReportOptions, write_report_files


def report(results: Sequence[Path], wanted: ReportOptions) -> int:
    """Read, compute, and say it; nothing is written when anything is wrong."""
    sys.stdout.write(write_report_files(results, wanted))
    return Exit.OK
