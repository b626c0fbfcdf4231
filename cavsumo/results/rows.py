"""The results of an episode: its row in the CSV, and the trace beside it.

Both are made in the simulating process, so that the collecting process only writes.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from cavsumo.assertions.judgement import HELD, VIOLATED
from cavsumo.results.columns import COLUMNS, Row


@dataclass(frozen=True)
class Outcome:
    """One finished episode.

    Attributes:
        row: its row, by column.
        trace: the bytes of its trace file, empty for none.
        ego_log: the output of an external ego, which may differ from run to run; mostly empty.
    """

    row: Row
    trace: bytes = b""
    ego_log: str = ""


def cell(value: Any) -> str:
    """A value in the CSV: empty for None, floats to three decimals.

    Line breaks become spaces: a row is a line, so a torn one shows.
    """
    if value is None or value == "":
        return ""
    if isinstance(value, float):
        return "" if not math.isfinite(value) else f"{value:.3f}".replace("-0.000", "0.000")
    return " ".join(str(value).splitlines())


def row_line(row: Mapping[str, Any]) -> str:
    """A row as a line of the CSV, with its end."""
    line = io.StringIO()
    cells = [cell(row.get(column)) for column in COLUMNS]
    csv.writer(line, lineterminator="\n").writerow(cells)
    return line.getvalue()


def verdicts_of(row: Mapping[str, Any]) -> dict[str, str]:
    """The verdict of every assertion on an episode; empty if not recorded."""
    said = str(row.get("verdicts") or "").split()
    return {name: verdict for name, _, verdict in (word.rpartition("=") for word in said)}


def is_test(row: Mapping[str, Any]) -> bool:
    """Whether the precondition was triggered: a test in the seed's sense."""
    return row["outcome"] in (HELD, VIOLATED)


def is_failure(row: Mapping[str, Any]) -> bool:
    """Whether the ego violated an assertion in this episode."""
    return bool(row["outcome"] == VIOLATED)
