"""Results and episodes in a line of text, and as the tables that a notebook shows."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

from cavsumo.batch import sentences
from cavsumo.batch.replay import Record
from cavsumo.batch.summary import percent
from cavsumo.batch.tally import Found, Tally
from cavsumo.model.scenario import Scenario
from cavsumo.report.pages.replay.facts import facts, headline, verdict
from cavsumo.results.traces import Trace

if TYPE_CHECKING:
    import pandas

MOST = 10  # failures in a notebook; ``failures`` has all
AGENTS = ("agent", "episodes", "preventable", "failures", "tests", "rate", "unfair", "errors")
FAILURES = ("run", "agent", "assertion", "tester", "violation_time_s", "avoidable")


@dataclass(frozen=True)
class ResultsSummary:
    """The summary of results.

    Attributes:
        scenario, tally: the scenario and the counts.
        failures: the rows of failures, preventable ones first.
        judged: whether a reference driver judged them.
        place: where they lie, and how the batch stands.
    """

    scenario: Scenario
    tally: Tally
    failures: pandas.DataFrame
    judged: bool
    place: str


def results_text(summary: ResultsSummary) -> str:
    """Results as one line."""
    return f"<Results: {_headline(summary)}>"


def results_html(summary: ResultsSummary) -> str:
    """Results as a table of the agents, and one of the first failures."""
    judged, agents = summary.judged, summary.tally.agents.items()
    lines = [_agent(name, found, judged) for name, found in agents]
    parts = [f"<p>{escape(_headline(summary))}</p>", _table(AGENTS, lines)]
    if warning := sentences.frozen(summary.tally.all):
        parts.append(f"<p>{escape(warning)}</p>")
    if total := len(summary.failures):
        more = f", {MOST} of {total}" if total > MOST else ""
        parts.append(f"<p>Failures, preventable ones first{more}:</p>")
        first = summary.failures.head(MOST)[list(FAILURES)].to_dict("records")
        parts.append(_table(FAILURES, [[_word(row[name]) for name in FAILURES] for row in first]))
    return "\n".join(parts)


def episode_text(record: Record, trace: Trace) -> str:
    """An episode as one line."""
    said = f"{headline(record)}: {verdict(record.row)}"
    return f"<RecordedEpisode: {said} {len(trace.frames)} frames>"


def episode_html(record: Record, trace: Trace) -> str:
    """An episode as a table of its identity and its results."""
    said = f"<p><b>{escape(headline(record))}</b>. {escape(verdict(record.row))}</p>"
    return f"{said}\n{_table((), facts(record, trace))}"


def _headline(summary: ResultsSummary) -> str:
    """The scenario, the results and their file."""
    scenario, found = summary.scenario, summary.tally.all
    said = f"{summary.tally.rows} episodes on {scenario.name}, ego {scenario.ego}: "
    said += sentences.failures(found, summary.judged)
    said += f" in {sentences.many(found.tests, 'test')}"
    said += f", {sentences.many(found.errors, 'error')}" if found.errors else ""
    said += f", the ego froze in {found.frozen.total()}" if found.frozen else ""
    return f"{said}; {summary.place}" if summary.place else said


def _agent(name: str, found: Found, judged: bool) -> list[str]:
    """A line of the table of agents."""
    preventable = str(found.preventable) if judged else ""
    rate = percent(found.rate("tests").value)
    counts = [str(found.episodes), preventable, str(found.failures), str(found.tests), rate]
    return [name, *counts, str(found.unfair), str(found.errors)]


def _word(value: Any) -> str:
    """A value of a row; nothing for a missing one."""
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:g}"
    return str(value)


def _table(heads: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """A table of HTML; every cell is escaped."""
    rows = [f"<tr>{''.join(f'<th>{escape(head)}</th>' for head in heads)}</tr>"] if heads else []
    rows += [f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in line)}</tr>" for line in lines]
    return f"<table>{''.join(rows)}</table>"
