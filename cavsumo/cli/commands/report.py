"""``cavsumo report``: the evidence of one or several results files."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from cavsumo.cli.steps import SlowSteps, say_written
from cavsumo.errors import Exit
from cavsumo.report.files import write_report_files
from cavsumo.report.order import ReportOptions


def report(results: Sequence[Path], wanted: ReportOptions) -> int:
    """Read, compute and print; no file is written after an error."""
    with SlowSteps() as steps:
        written = write_report_files(results, wanted, steps.begin)
    sys.stdout.write(written.text)
    for problem in written.problems:
        print(f"cavsumo: --html: {problem}", file=sys.stderr)
    say_written(written.files)
    return Exit.OK
