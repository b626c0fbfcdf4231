"""Failures in order of importance: preventable ones first.

A failure is an episode in which the ego violated an assertion. It is *preventable* if the reference
driver would have avoided it, *unpreventable* if not (UN R157), *not judged* if that was not
requested or not possible.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

from cavsumo.assertions.judgement import HELD, NOT_TRIGGERED, UNFAIR, VIOLATED
from cavsumo.results.grade import INVALID_GRADE
from cavsumo.results.rows import cell, is_failure, verdicts_of

PREVENTABLE, NOT_JUDGED, UNPREVENTABLE = "preventable", "not judged", "unpreventable"
ORDER = (PREVENTABLE, NOT_JUDGED, UNPREVENTABLE)

AnyRow = TypeVar("AnyRow", bound=Mapping[str, Any])


def failure_kind(row: Mapping[str, Any]) -> str:
    """The kind of failure of an episode, empty for none.

    Args:
        row: as made, as text, or from a table whose numbers are floats (NaN for none).
    """
    if not is_failure(row):
        return ""
    said = cell(row.get("avoidable"))
    if not said:
        return NOT_JUDGED
    return PREVENTABLE if float(said) == 1.0 else UNPREVENTABLE


def graded(row: Mapping[str, Any]) -> tuple[float, bool]:
    """The grade of a row, and whether it is a preventable failure or one that nobody judged."""
    said = cell(row["grade"])
    found = float(said) if said else INVALID_GRADE
    return found, failure_kind(row) in (PREVENTABLE, NOT_JUDGED) and found >= 0.0


def violations(row: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The violations in an episode: each assertion's name with VIOLATED, and with a kind.

    Kinds are those of a failure, and UNFAIR for an unfair test. Only the violation that the row
    names is judged; others of its episode are not.
    """
    if row["outcome"] not in (HELD, VIOLATED, UNFAIR, NOT_TRIGGERED):
        return []
    found = list[tuple[str, str]]()
    for name, verdict in verdicts_of(row).items():
        if verdict == VIOLATED:
            named = name == row["assertion"]
            found += [(name, VIOLATED), (name, failure_kind(row) if named else NOT_JUDGED)]
        elif verdict == UNFAIR:
            found.append((name, UNFAIR))
    return found


def preventable_first(rows: Iterable[AnyRow]) -> list[AnyRow]:
    """The failures among some rows, by kind; each kind in the order of the rows."""
    failures = [row for row in rows if is_failure(row)]
    return sorted(failures, key=lambda row: ORDER.index(failure_kind(row)))
