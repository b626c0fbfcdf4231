"""The table that ends a batch: what each agent found, with intervals."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console
from rich.table import Table

from cavsumo.outcomes import cell, is_failure
from cavsumo.references import REFERENCES
from cavsumo.statistics import Rate
from cavsumo.tally import Found, Row, Tally

WIDTH = 120  # a table cut off at the edge of a narrow terminal would hide figures


def summarise(
    tally: Tally, csv_file: Path, traces: int, *, sequential: bool = False, shared: bool = False
) -> None:
    """Print the summary of a batch on stdout.

    Args:
        sequential: the number of episodes may depend on what they found, so the intervals must
            hold however it was decided to stop.
        shared: episodes shared simulations, and those played in a fresh one are found tests.
    """
    console = Console(width=WIDTH)
    console.print(_table(tally, sequential), highlight=False)
    if sequential:
        _say(console, "intervals: beta-binomial confidence sequences, valid whenever one stops")
    together = tally.all
    if shared and together.fresh:
        lost = together.fresh - together.tests
        _say(
            console,
            f"\n{together.fresh} tests found in shared simulations and played again in fresh ones: "
            f"{lost} ({percent(lost / together.fresh)}) did not come out as tests again",
        )
    files = f"{csv_file}, {csv_file.with_suffix('.json')}"
    if traces:
        files += f", {csv_file.with_suffix('')}/ ({traces} traces)"
    _say(
        console,
        f"\n{together.tests} tests in {tally.rows} episodes, {together.failures} of them failed "
        f"by the ego.  {files}",
    )
    if together.failures:
        _say_preventable(tally, console)
    error = tally.first.get("error")
    if error:
        _say(
            console,
            f"{together.errors} could not be run; run {error['run']}: {cell(error['error'])}"
            "\n       run again with --retry-errors to play them again",
        )
    if not together.failures and together.tests:
        bound = together.rate("failures", sequential=sequential).high
        _say(
            console,
            f"no failure in {together.tests} tests: at most {100 * (bound or 0):.1f} % (95 %)",
        )
    _say_first(tally, csv_file, console)


def _table(tally: Tally, sequential: bool) -> Table:
    """One line an agent."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column("agent", overflow="fold")  # a path may be long
    for title in ("runs", "tests", "rate", "95 % interval", "failures", "of tests"):
        table.add_column(title, justify="right", no_wrap=True)
    for title in ("unfair", "errors", "median time"):
        table.add_column(title, justify="right", no_wrap=True)
    for agent, found in tally.agents.items():
        table.add_row(agent, *_cells(found, sequential))
    return table


def _cells(found: Found, sequential: bool) -> list[str]:
    """The cells of one agent."""
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
        str(found.errors),
        "" if median is None else f"{median:.1f} s",
    ]


def _say_preventable(tally: Tally, console: Console) -> None:
    """How many failures the reference driver would have avoided, if that was asked."""
    reference = str(tally.first["failure"].get("reference") or "")
    if reference not in REFERENCES:
        return
    together = tally.all
    left = together.failures - together.preventable.total()
    words = REFERENCES.make(reference, {}).words
    _say(
        console,
        f"{together.failures} failure{'s' * (together.failures > 1)}, "
        f"{together.preventable[True]} of them preventable by {words}"
        + (f", {left} not judged" if left else ""),
    )


def _say_first(tally: Tally, csv_file: Path, console: Console) -> None:
    """Point to the first failure, else the first test, and how to see it again."""
    for what in ("failure", "test"):
        row = tally.first.get(what)
        if row is not None:
            _say(
                console,
                f"first {what}: run {row['run']} ({row['agent']}): {event(row)}"
                f"\n       cavsumo replay {csv_file} {row['run']} --html run{row['run']}.html",
            )
            return


def event(row: Row) -> str:
    """What happened in a test, when and with whom."""
    violated = is_failure(row)
    when = float(row["violation_time_s"] if violated else row["trigger_time_s"])
    hit = violated and cell(row["impact_speed_mps"])
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
