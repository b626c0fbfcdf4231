"""The table of a transfer: a line for each test on each network."""

from __future__ import annotations

from collections.abc import Sequence

from cavsumo.kept.transferred import Transferred
from cavsumo.report.cells import Table
from cavsumo.report.formats import drawn
from cavsumo.results.statistics import Rate

WORDS = ("test", "network")
NUMBERS = ("places", "fails at", "[95 %]", "episodes", "fail", "again", "[95 %]")


def transfer_table(found: Sequence[Transferred]) -> str:
    """A line for each result, without an end of line after the last one."""
    rows = [_row(one) for one in found]
    return drawn(Table("results", "", WORDS, NUMBERS, rows)).rstrip("\n")


def _row(one: Transferred) -> tuple[str, ...]:
    """The cells of a line."""
    at, again = one.again_at, one.again
    share = "" if again.value is None else f"{100 * again.value:.1f} %"
    counts = str(at.count), _interval(at), str(one.episodes), str(one.failures)
    return (one.test, one.net, str(one.places), *counts, share, _interval(again))


def _interval(one: Rate) -> str:
    """An interval in percent."""
    if one.low is None or one.high is None:
        return ""
    return f"[{100 * one.low:4.1f}, {100 * one.high:5.1f}]"
