"""The table that ends a run: the results of each agent, with intervals."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from cavsumo.agents.base import VERDICTS
from cavsumo.assertions.base import HELD, INVALID, UNFAIR, VIOLATED
from cavsumo.batch import sentences
from cavsumo.batch.ended import Ended
from cavsumo.batch.tally import Found, Row, found_by
from cavsumo.results.failures import NOT_JUDGED, ORDER, PREVENTABLE, UNPREVENTABLE
from cavsumo.results.kaplan_meier import median_in_words
from cavsumo.results.rows import cell
from cavsumo.results.statistics import Rate

WORD = 28  # letters of a name that are not broken
WIDTH, WIDEST = 120, 1000  # a table cut off at the edge of a narrow terminal would hide figures


def summarise(ended: Sequence[Ended], head: str = "") -> None:
    """Print the summary of one or several batches on stdout.

    ``head``: a table in place of that of the agents.
    """
    console = Console(width=WIDTH)
    table = Text(head) if head else _table(ended)
    least = Measurement.get(console, console.options.update(width=WIDEST), table)
    console.width = max(WIDTH, least.maximum if head else least.minimum)
    console.print(table, highlight=False)
    if any(len(f.verdicts) > 1 for one in ended for f in one.tally.agents.values()):
        console.print()
        console.print(_verdicts(ended), highlight=False)
    if any(one.sequential for one in ended):
        _say(console, "intervals: beta-binomial confidence sequences, valid whenever one stops")
    together = found_by(found for one in ended for found in one.tally.agents.values())
    rows = sum(one.tally.rows for one in ended)
    tests, episodes = sentences.many(together.tests, "test"), sentences.many(rows, "episode")
    failed = sentences.failures(together, _judged(ended))
    _say(console, f"\n{failed}, {tests} in {episodes}.  {_files(ended)}")
    _say_invalid(ended, console)
    for one in ended:
        _say_forecasts(one, console)
        _say_failures(one, console)
        _say_searches(one, console)
        _say_drive(one, console)
    _say_errors(ended, console)
    _say_bound(ended, console)
    _say_first(ended, console)


def _table(ended: Sequence[Ended]) -> Table:
    """One line per agent of each batch."""
    several = any(one.name for one in ended)
    failures = PREVENTABLE if any(one.judged for one in ended) else "failures"
    others = _others(ended)
    words = ["batch", "agent"] if several else ["agent"]
    numbers = ["runs", failures, "of tests [95 %]", "tests", "rate [95 %]", *others, "errors"]
    numbers.append("median to test")
    rows = [
        [one.name if i == 0 else "", agent][-len(words) :]
        + _cells(found, one.sequential, failures, others)
        for one in ended
        for i, (agent, found) in enumerate(one.tally.agents.items())
    ]
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for i, title in enumerate((*words, *numbers)):
        longest = max(len(cell) for cell in (title, *(row[i] for row in rows)))
        if i < len(words):  # a path may be long
            table.add_column(Text(title), overflow="fold", min_width=min(WORD, longest))
        else:
            table.add_column(Text(title), justify="right", no_wrap=True, min_width=longest)
    for row in rows:
        table.add_row(*map(Text, row))
    return table


def _others(ended: Sequence[Ended]) -> list[str]:
    """The columns that are counted apart: other failures, and episodes that are no tests."""
    everything = found_by(one.tally.all for one in ended)
    judged = any(one.judged for one in ended)
    return [
        *([UNPREVENTABLE] if judged else []),
        *([NOT_JUDGED] if judged and everything.not_judged else []),
        "unfair",
        *(["invalid"] if everything.invalid else []),
    ]


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
    return result_files(first)


def result_files(ended: Ended) -> str:
    """The files of a batch: rows, manifest, folder of traces."""
    files = f"{ended.csv_file}, {ended.csv_file.with_suffix('.json')}"
    if ended.traces:
        traces = sentences.many(ended.traces, "trace")
        files += f", {ended.csv_file.with_suffix('')}/ ({traces})"
    return files


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


def _cells(found: Found, sequential: bool, failures: str, others: Sequence[str]) -> list[str]:
    """The cells of one agent: the failures that lead, tests, and the columns of ``others``."""
    tests, failed = (found.rate(r, sequential=sequential) for r in ("tests", failures))
    median = median_in_words(found.curve())
    return [
        str(found.episodes),
        str(failed.count),
        f"{percent(failed.value)} {interval(failed)}".strip(),
        str(found.tests),
        f"{percent(tests.value)} {interval(tests)}".strip(),
        *(str(getattr(found, name.replace(" ", "_"))) for name in others),
        str(found.errors),
        f"{median} s" if median else "",
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
                _of(one)
                + f"{agent}: of {total} starts {sure.total()} are sure, {open_.total()} undecided, "
                f"{lost.total()} not forceable against {one.promises.get(agent, 'its egos')}; "
                f"tests in {sure[True]}, {open_[True]} and {lost[True]} of them",
            )


def _say_failures(one: Ended, console: Console) -> None:
    """Print the preventable failures of a batch, and apart from them the others."""
    said = sentences.judgement(one.tally.all, one.reference) if one.judged else ""
    if said:
        _say(console, _of(one) + said)


def _say_searches(one: Ended, console: Console) -> None:
    """The findings of each search of a batch."""
    for agent, found in one.searches.items():
        _say(console, f"{_of(one)}{agent}: {sentences.searched(found)}")


def _say_drive(one: Ended, console: Console) -> None:
    """How the ego of a batch came along; an ego that stood still or crawled is named."""
    found, row = one.tally.all, one.tally.first.get("frozen")
    for said in filter(None, (sentences.drive(found), sentences.frozen(found))):
        _say(console, _of(one) + said)
    if row is not None:
        _say(console, f"       first: {_replay(one, row)}")


def _say_bound(ended: Sequence[Ended], console: Console) -> None:
    """Print the bound where no failure was found; unpreventable ones apart.

    Tests that a search chose prove none.
    """
    if any(one.searches for one in ended):
        return
    together, judged = found_by(one.tally.all for one in ended), _judged(ended)
    if not together.tests or together.preventable or together.not_judged:
        return
    name = "preventable" if judged else "failures"
    bound = together.rate(name, sequential=any(one.sequential for one in ended)).high
    what = "preventable failure" if judged else "failure"
    tests = sentences.many(together.tests, "test")
    _say(console, f"no {what} in {tests}: at most {100 * (bound or 0):.1f} % (95 %)")


def _say_first(ended: Sequence[Ended], console: Console) -> None:
    """Point to the first failure, a preventable one if there is any, else to the first test."""
    for kind in (*ORDER, "test"):
        for one in ended:
            row = one.tally.first.get(kind)
            if row is not None:
                what = kind if kind == "test" else f"{kind} failure" if one.judged else "failure"
                told = f"first {what}: run {row['run']} ({row['agent']}): {sentences.event(row)}"
                _say(console, f"{told}\n       {_replay(one, row)}")
                return


def _replay(one: Ended, row: Row) -> str:
    """The command that shows an episode."""
    return f"cavsumo replay {one.csv_file} {row['run']} --html run{row['run']}.html"


def _of(one: Ended) -> str:
    """The beginning of a sentence about one of several batches."""
    return f"{one.name}: " if one.name else ""


def _judged(ended: Sequence[Ended]) -> bool:
    """Whether the failures of all batches were judged."""
    return all(one.judged for one in ended)


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
