"""The table that ends a batch: what each agent found, with intervals."""

from __future__ import annotations

import statistics as stats
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from cavsumo.assertions.base import HELD, UNFAIR, VIOLATED
from cavsumo.outcomes import is_failure
from cavsumo.statistics import Rate, rate

WIDTH = 120  # a table cut off at the edge of a narrow terminal would hide figures
Rows = Sequence[Mapping[str, Any]]


def is_test(row: Mapping[str, Any]) -> bool:
    """Whether the precondition was triggered: a test in the seed's sense."""
    return row["outcome"] in (HELD, VIOLATED)


def is_valid(row: Mapping[str, Any]) -> bool:
    """Whether an episode counts as tried."""
    return row["outcome"] not in ("error", "invalid")


def test_rate(rows: Rows) -> Rate:
    """Tests among all valid episodes."""
    return rate(sum(map(is_test, rows)), sum(map(is_valid, rows)))


def failure_rate(rows: Rows) -> Rate:
    """Failures among tests."""
    return rate(sum(map(is_failure, rows)), sum(map(is_test, rows)))


def summarise(rows: Rows, csv_file: Path, traces: int) -> None:
    """Print the summary of a batch on stdout."""
    console = Console(width=WIDTH)
    console.print(_table(rows), highlight=False)
    tests, failures = sum(map(is_test, rows)), sum(map(is_failure, rows))
    files = f"{csv_file}, {csv_file.with_suffix('.json')}"
    if traces:
        files += f", {csv_file.with_suffix('')}/ ({traces} traces)"
    said = (
        f"\n{tests} tests in {len(rows)} episodes, {failures} of them failed by the ego.  {files}"
    )
    _say(console, said)
    errors = [r for r in rows if r["outcome"] == "error"]
    if errors:
        first = errors[0]
        _say(console, f"{len(errors)} could not be run; run {first['run']}: {first['error']}")
    if not failures and tests:
        bound = failure_rate(rows).high
        _say(console, f"no failure in {tests} tests: at most {100 * (bound or 0):.1f} % (95 %)")
    _say_first(rows, csv_file, console)


def _table(rows: Rows) -> Table:
    """One line an agent."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column("agent")
    for title in ("runs", "tests", "rate", "95 % interval", "failures", "of tests"):
        table.add_column(title, justify="right", no_wrap=True)
    for title in ("unfair", "errors", "median time"):
        table.add_column(title, justify="right", no_wrap=True)
    for agent in dict.fromkeys(r["agent"] for r in rows):
        table.add_row(*_cells(agent, [r for r in rows if r["agent"] == agent]))
    return table


def _cells(agent: str, rows: Rows) -> list[str]:
    """The cells of one agent."""
    outcomes = Counter(r["outcome"] for r in rows)
    tests, failures = test_rate(rows), failure_rate(rows)
    times = [r["trigger_time_s"] for r in rows if is_test(r)]
    return [
        agent,
        str(len(rows)),
        str(tests.count),
        percent(tests.value),
        interval(tests),
        str(failures.count),
        f"{percent(failures.value)} {interval(failures)}".strip(),
        str(outcomes[UNFAIR]),
        str(outcomes["error"]),
        f"{stats.median(times):.1f} s" if times else "",
    ]


def _say_first(rows: Rows, csv_file: Path, console: Console) -> None:
    """Point to the first failure, else the first test, and how to see it again."""
    for what, chosen in (("failure", is_failure), ("test", is_test)):
        for row in filter(chosen, rows):
            _say(
                console,
                f"first {what}: run {row['run']} ({row['agent']}): {_event(row)}"
                f"\n       cavsumo replay {csv_file} {row['run']}",
            )
            return


def _event(row: Mapping[str, Any]) -> str:
    """What happened in a test, when and with whom."""
    violated = is_failure(row)
    when = row["violation_time_s"] if violated else row["trigger_time_s"]
    hit = violated and row["impact_speed_mps"] is not None
    what = "collision" if hit else f"{row['assertion']} {'violated' if violated else 'triggered'}"
    whom = f" with {row['tester']}" if row["tester"] else ""
    return f"{what} at {when:.1f} s{whom}"


def _say(console: Console, text: str) -> None:
    """Print plain text, never wrapped, marked up or coloured."""
    console.print(text, markup=False, highlight=False, soft_wrap=True)


def percent(share: float | None) -> str:
    """A share in per cent, empty for none."""
    return "" if share is None else f"{100 * share:.1f} %"


def interval(found: Rate) -> str:
    """An interval in per cent, empty for none."""
    if found.low is None or found.high is None:
        return ""
    return f"[{100 * found.low:.1f}, {100 * found.high:.1f}]"
