"""Failures by kind: what is preventable comes first, what was not judged is said so."""

from __future__ import annotations

import math
from typing import Any

import pytest

from cavsumo.results.failures import failure_kind, preventable_first, violations


def failure(run: int, avoidable: Any) -> dict[str, Any]:
    """A row of an episode that the ego failed."""
    return {"run": run, "outcome": "violated", "avoidable": avoidable}


@pytest.mark.parametrize(
    ("avoidable", "kind"),
    [
        *((value, "preventable") for value in (1, "1", 1.0)),
        *((value, "unpreventable") for value in (0, "0", 0.0)),
        *((value, "not judged") for value in (None, "", math.nan)),
    ],
)
def test_a_kind_is_found_however_the_row_was_read(avoidable: Any, kind: str) -> None:
    """As it was made, as text of a CSV, as floats of a table."""
    assert failure_kind(failure(0, avoidable)) == kind


def test_preventable_failures_come_first() -> None:
    """Then those that were not judged, then the unpreventable; runs in order within a kind."""
    rows = [failure(0, 0), failure(1, None), failure(2, 1), {"outcome": "held"}, failure(4, 1)]
    assert [row["run"] for row in preventable_first(rows)] == [2, 4, 1, 0]


def test_a_violation_is_judged_where_the_row_names_it() -> None:
    """Of two violated assertions one is judged; nothing counts in an invalid episode."""
    row = {"outcome": "violated", "assertion": "rss", "avoidable": "1"}
    row["verdicts"] = "rss=violated ttc=violated reaction-zone=unfair drac=held"
    assert violations(row) == [
        ("rss", "violated"),
        ("rss", "preventable"),
        ("ttc", "violated"),
        ("ttc", "not judged"),
        ("reaction-zone", "unfair"),
    ]
    assert violations({**row, "outcome": "invalid"}) == []
