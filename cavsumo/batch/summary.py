"""The table that ends a run: the results of each agent, with intervals."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from rich.measure import Measurement
from rich.table import Table

from cavsumo.agents.base import VERDICTS
from cavsumo.assertions.base import HELD, INVALID, UNFAIR, VIOLATED
from cavsumo.batch.tally import Found, Row, Tally, found_by
from cavsumo.egos.reference import REFERENCES
from cavsumo.results.rows import cell, is_failure
from cavsumo.results.statistics import Rate

WIDTH, WIDEST = 120, 1000  # a table cut off at the edge of a narrow terminal would hide figures


@dataclass(frozen=True)
class Ended:
    """Result of a finished batch.

    Attributes:
        name: its name in a study; empty for none.
        csv_file, tally, traces: its results file, its counts, the number of traces.
        sequential: the number of episodes may depend on their results, so the intervals must be
            valid at any stopping time.
        shared: episodes shared simulations, and those played in a fresh one are found tests.
        cut_short: the user stopped it.
        promises: by agent, the class of egos for which its forecasts hold.
    """

    name: str
    csv_file: Path
    tally: Tally
    traces: int = 0
    sequential: bool = False
    shared: bool = False
    cut_short: bool = False
    promises: Mapping[str, str] = field(default_factory=dict)


def summarise(ended: Sequence[Ended]) -> None:
    """Print the summary of one or several batches on stdout."""
    console, table = Console(width=WIDTH), _table(ended)
    least = Measurement.get(console, console.options.update(width=WIDEST), table).minimum
    console.width = max(WIDTH, least)
    console.print(table, highlight=False)
    if any(len(f.verdicts) > 1 for one in ended for f in one.tally.agents.values()):
        console.print()
        console.print(_verdicts(ended), highlight=False)
    if any(one.sequential for one in ended):
        _say(console, "intervals: beta-binomial confidence sequences, valid whenever one stops")
    together = found_by(found for one in ended for found in one.tally.agents.values())
    _say_shared(ended, console)
    rows = sum(one.tally.rows for one in ended)
    _say(
        console,
        f"\n{together.tests} tests in {rows} episodes, {together.failures} of them failed "
        f"by the ego.  {_files(ended)}",
    )
    _say_invalid(ended, console)
    for one in ended:
        _say_forecasts(one, console)
        _say_preventable(one, console)
    _say_errors(ended, console)
    if not together.failures and together.tests:
        sequential = any(one.sequential for one in ended)
        bound = together.rate("failures", sequential=sequential).high
        _say(
            console,
            f"no failure in {together.tests} tests: at most {100 * (bound or 0):.1f} % (95 %)",
        )
    _say_first(ended, console)


def _table(ended: Sequence[Ended]) -> Table:
    """One line per agent of each batch."""
    several = any(one.name for one in ended)
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for title in ("batch", "agent") if several else ("agent",):
        table.add_column(title, overflow="fold")  # a path may be long
    for title in ("runs", "tests", "rate", "95 % interval", "failures", "of tests"):
        table.add_column(title, justify="right", no_wrap=True)
    invalid = any(one.tally.all.invalid for one in ended)
    for title in ("unfair", *(["invalid"] if invalid else []), "errors", "median time"):
        table.add_column(title, justify="right", no_wrap=True)
    for one in ended:
        for i, (agent, found) in enumerate(one.tally.agents.items()):
            head = [one.name if i == 0 else "", agent] if several else [agent]
            table.add_row(*head, *_cells(found, one.sequential, invalid))
    return table


def _verdicts(ended: Sequence[Ended]) -> Table:
    """One line per assertion, agent and batch: the number of episodes with each verdict."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    several = any(one.name for one in ended)
    for title in ("batch", "agent", "assertion") if several else ("agent", "assertion"):
        table.add_column(title, overflow="fold")
    for title in ("triggered", "held", "violated", "unfair"):
        table.add_column(title, justify="right", no_wrap=True)
    for one in ended:
        for agent, found in one.tally.agents.items():
            for name, said in found.verdicts.items():
                head = [one.name, agent, name] if several else [agent, name]
                counts = said[HELD] + said[VIOLATED], said[HELD], said[VIOLATED], said[UNFAIR]
                table.add_row(*head, *map(str, counts))
    return table


def _files(ended: Sequence[Ended]) -> str:
    """The files of the results."""
    first, last = ended[0], ended[-1]
    if first is not last:
        return f"{first.csv_file} to {last.csv_file.name} ({len(ended)} batches)"
    files = f"{first.csv_file}, {first.csv_file.with_suffix('.json')}"
    if first.traces:
        files += f", {first.csv_file.with_suffix('')}/ ({first.traces} traces)"
    return files


def _say_shared(ended: Sequence[Ended], console: Console) -> None:
    """The number of tests from shared simulations that did not occur again."""
    found = [one.tally.all for one in ended if one.shared]
    fresh, tests = sum(one.fresh for one in found), sum(one.tests for one in found)
    if fresh:
        lost = fresh - tests
        _say(
            console,
            f"\n{fresh} tests found in shared simulations and played again in fresh ones: "
            f"{lost} ({percent(lost / fresh)}) did not come out as tests again",
        )


def _say_invalid(ended: Sequence[Ended], console: Console) -> None:
    """The number of invalid episodes, and the first of them."""
    count = sum(one.tally.all.invalid for one in ended)
    row, where = _first(ended, INVALID)
    if row is not None:
        _say(console, f"{count} invalid; run {row['run']}{where}: {row['breach']}")


def _say_errors(ended: Sequence[Ended], console: Console) -> None:
    """The number of error episodes, and the first of them."""
    errors = sum(one.tally.all.errors for one in ended)
    row, where = _first(ended, "error")
    if row is not None:
        _say(
            console,
            f"{errors} could not be run; run {row['run']}{where}: {cell(row['error'])}"
            "\n       run again with --retry-errors to play them again",
        )


def _first(ended: Sequence[Ended], what: str) -> tuple[Row | None, str]:
    """The first row of a kind, and its results file among several."""
    for one in ended:
        row = one.tally.first.get(what)
        if row is not None:
            return row, f" of {one.csv_file}" if len(ended) > 1 else ""
    return None, ""


def _cells(found: Found, sequential: bool, invalid: bool) -> list[str]:
    """The cells of one agent; ``invalid``: with the number of invalid episodes."""
    tests, failures = (found.rate(r, sequential=sequential) for r in ("tests", "failures"))
    median = found.median_time()
    return [
        str(found.episodes),
        str(found.tests),
        percent(tests.value),
        interval(tests),
        str(found.failures),
        f"{percent(failures.value)} {interval(failures)}".strip(),
        str(found.unfair),
        *([str(found.invalid)] if invalid else []),
        str(found.errors),
        "" if median is None else f"{median:.1f} s",
    ]


def _say_forecasts(one: Ended, console: Console) -> None:
    """The forecasts of an agent, and the tests that resulted."""
    for agent, found in one.tally.agents.items():
        said = {verdict: found.forecasts.get(verdict, Counter()) for verdict in VERDICTS}
        if found.forecasts:
            sure, open_, lost = said.values()
            total = sum(count.total() for count in said.values())
            _say(
                console,
                (f"{one.name}: " if one.name else "")
                + f"{agent}: of {total} starts {sure.total()} are sure, {open_.total()} undecided, "
                f"{lost.total()} not forceable against {one.promises.get(agent, 'its egos')}; "
                f"tests in {sure[True]}, {open_[True]} and {lost[True]} of them",
            )


def _say_preventable(one: Ended, console: Console) -> None:
    """The number of failures that the reference driver would have avoided, if they were judged."""
    row = one.tally.first.get("failure")
    reference = str(row.get("reference") or "") if row else ""
    if reference not in REFERENCES:
        return
    together = one.tally.all
    left = together.failures - together.preventable.total()
    words = REFERENCES.make(reference, {}).words
    _say(
        console,
        (f"{one.name}: " if one.name else "")
        + f"{together.failures} failure{'s' * (together.failures > 1)}, "
        f"{together.preventable[True]} of them preventable by {words}"
        + (f", {left} not judged" if left else ""),
    )


def _say_first(ended: Sequence[Ended], console: Console) -> None:
    """Print the first failure, else the first test, with its replay command."""
    for what in ("failure", "test"):
        for one in ended:
            row = one.tally.first.get(what)
            if row is not None:
                _say(
                    console,
                    f"first {what}: run {row['run']} ({row['agent']}): {event(row)}"
                    f"\n       cavsumo replay {one.csv_file} {row['run']} --html "
                    f"run{row['run']}.html",
                )
                return


def event(row: Row) -> str:
    """The event of a test, with its time and body."""
    violated = is_failure(row)
    when = float(row["violation_time_s"] if violated else row["trigger_time_s"])
    hit = violated and cell(row["impact_speed_mps"])
    what = "collision" if hit else f"{row['assertion']} {'violated' if violated else 'triggered'}"
    tester = f" with {row['tester']}" if row["tester"] else ""
    return f"{what} at {when:.1f} s{tester}"


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
