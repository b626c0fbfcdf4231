"""The parts of a report's tables: the table itself, labels of groups, numbers as text."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from cavsumo.report.analysis import Report
from cavsumo.report.grouping import Told
from cavsumo.results.statistics import Interval

TOPICS = ("results", "shares", "pairs", "times", "effort", "distinct")


@dataclass(frozen=True)
class Table:
    """A table of text.

    Attributes:
        topic: one of ``TOPICS``.
        title: its title.
        words: the titles of its first columns, which hold words, aligned to the left.
        numbers: the titles of the others, which hold numbers, aligned to the right.
        rows: one cell a column.
        heads: number of first columns in which words equal to those above may be left out.
        notes: explanations, one sentence each.
    """

    topic: str
    title: str
    words: Sequence[str]
    numbers: Sequence[str]
    rows: Sequence[Sequence[str]]
    notes: Sequence[str] = ()
    heads: int = 0


class Labels:
    """The columns that identify the group of a row, as few as are needed."""

    def __init__(self, report: Report) -> None:
        several = any(group.setting for group in report.groups)
        self.titles = [*(["setting"] if several else []), "agent"]
        self.titles += [] if report.by == "agent" else [report.by]

    def cells(self, of: Told) -> list[str]:
        """The cells for a group."""
        words = {"setting": of.setting, "agent": of.agent}
        return [words.get(title, of.value or "(none)") for title in self.titles]


def number(value: float) -> str:
    """Three significant digits, without an exponent where that is readable."""
    if math.isinf(value) or value == 0:
        return f"{value:g}"
    if abs(value) < 1e-4 or abs(value) >= 1e5:
        return f"{value:.2e}"
    digits = max(0, 2 - math.floor(math.log10(abs(value))))
    return f"{value:.{digits}f}"


def span(ends: Interval | None, form: str = "") -> str:
    """An interval, empty for none."""
    if ends is None:
        return ""
    return "[{}, {}]".format(*(number(e) if not form else format(e, form) for e in ends))


def p_value(value: float) -> str:
    """A p-value."""
    return "< 0.001" if value < 0.001 else f"{value:.3f}"
