"""JUnit XML for continuous integration: a suite per file, a case per agent and assertion.

Of a suite of tests each of its cases is a case.
"""

from __future__ import annotations

import re
import shlex
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import pandas

from cavsumo.assertions.base import HELD, VIOLATED
from cavsumo.batch import sentences
from cavsumo.batch.sentences import event
from cavsumo.batch.summary import interval, percent
from cavsumo.egos.reference import IDEAL
from cavsumo.report.driving import EgoDriving, driving
from cavsumo.report.grouping import Group, reference_of
from cavsumo.report.load import Batch, Evidence
from cavsumo.report.rates import Rates, rates
from cavsumo.results.failures import ORDER, PREVENTABLE, failure_kind, preventable_first
from cavsumo.results.rows import verdicts_of

SHOWN = 20  # failures or errors told of in one case
# Characters that XML 1.0 cannot hold, even escaped.
ILLEGAL = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def junit(evidence: Evidence) -> str:
    """The whole document."""
    root = ET.Element("testsuites", name="cavsumo")
    for index, batch in enumerate(evidence.batches):
        rows = evidence.rows[evidence.rows["batch"] == index]
        root.append(_suite(batch, rows))
    totals(root, root.iter("testcase"))
    return document(root)


def document(root: ET.Element) -> str:
    """The text of a document."""
    ET.indent(root, " ")
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, "unicode") + "\n"


def _suite(batch: Batch, rows: pandas.DataFrame) -> ET.Element:
    """One results file."""
    suite = ET.Element("testsuite", name=legal(str(batch.csv_file)))
    properties = ET.SubElement(suite, "properties")
    cases = []
    for agent in batch.plan.cast:
        own = rows[rows["agent"] == agent]
        group = Group("", agent, "", own, batch.sequential, reference_of([batch]))
        _properties(properties, agent, rates(group))
        if batch.plan.suite is not None:
            cases += [_suite_case(batch, row) for row in own.to_dict("records")]
            continue
        cases += [_case(batch, agent, name, own) for name in batch.plan.scenario.assertions]
        cases += _standing(agent, driving(group))
        cases += _errors(agent, own)
    suite.extend(cases)
    totals(suite, cases)
    return suite


def _properties(parent: ET.Element, agent: str, found: Rates) -> None:
    """The shares of an agent with their intervals, preventable failures first."""
    judged = bool(found.reference)
    for what, share in (
        ("preventable", found.preventable) if judged else ("failures", found.failures),
        ("tests", found.tests),
        *([("unpreventable", found.unpreventable)] if judged else []),
        *([(f"preventable-{IDEAL}-only", found.by_ideal)] if found.by_ideal else []),
        ("unfair", found.unfair),
    ):
        spans = "; ".join(f"{m} {interval(r)}" for m, r in share.intervals.items() if share.total)
        text = f"{share.count} of {share.total} {share.of}"
        if share.total:
            text += f", {percent(share.value)}, 95 % interval by {spans}"
        ET.SubElement(parent, "property", name=legal(f"{agent}.{what}"), value=text)
    if found.invalid:
        text = f"{found.invalid} of {found.episodes} episodes"
        ET.SubElement(parent, "property", name=legal(f"{agent}.invalid"), value=text)


def _case(batch: Batch, agent: str, assertion: str, rows: pandas.DataFrame) -> ET.Element:
    """One agent and assertion: failed, held, or never tested."""
    said = _verdicts(rows, assertion)
    tests, failures = rows[said.isin(("held", "violated"))], rows[said == "violated"]
    case = ET.Element("testcase", classname=legal(agent), name=assertion)
    case.set("time", f"{rows['wall_s'].sum():.3f}")
    if len(failures):
        ordered = preventable_first(_own(row, assertion) for row in failures.to_dict("records"))
        told = [_replay(batch, row, assertion) for row in ordered[:SHOWN]]
        message = f"{_failed(batch, ordered, len(tests))}; first: {told[0]}"
        result(case, "failure", message, _with_rest(told, len(failures)), assertion)
    elif not len(tests):
        valid = int((~rows["outcome"].isin(("error", "invalid"))).sum())
        message = f"no test of it in {valid} valid episodes: nothing is known"
        ET.SubElement(case, "skipped", message=message)
    return case


def _suite_case(batch: Batch, row: Mapping[Any, Any]) -> ET.Element:
    """One case of a suite: avoided, failed, not played, or left out because a tester failed."""
    test, name = row["case"].partition("/")[0], row["case"]
    case = ET.Element("testcase", classname=legal(test), name=legal(name))
    case.set("time", f"{row['wall_s']:.3f}")
    if row["outcome"] == VIOLATED:
        told = _replay(batch, row, row["assertion"])
        result(case, "failure", told, told, row["assertion"])
    elif row["outcome"] == "error":
        result(case, "error", row["error"], row["error"], "error")
    elif row["outcome"] != HELD:
        message = f"run {row['run']}: {row['outcome']} {row['breach']}".strip()
        ET.SubElement(case, "skipped", message=legal(message))
    return case


def _own(row: Mapping[Any, Any], assertion: str) -> dict[Any, Any]:
    """A failure of an assertion; what was judged is that of the assertion of the row."""
    judged = row["avoidable"] if row["assertion"] == assertion else None
    return {**row, "outcome": VIOLATED, "avoidable": judged}


def _failed(batch: Batch, failures: Sequence[Mapping[Any, Any]], tests: int) -> str:
    """How many tests failed, the preventable failures first."""
    if batch.plan.reference == "none":
        return f"{len(failures)} of {tests} tests failed"
    kinds = Counter(failure_kind(row) for row in failures)
    preventable = sentences.many(kinds[PREVENTABLE], "failure")
    by = sentences.driver(batch.plan.reference)
    said = f"{preventable} of {tests} tests preventable by {by}"
    rest = ", ".join(f"{kinds[kind]} {kind}" for kind in ORDER[1:] if kinds[kind])
    return f"{said}; apart from that {rest}" if rest else said


def _verdicts(rows: pandas.DataFrame, assertion: str) -> pandas.Series:
    """The verdicts of an assertion; the outcome, if it is the only one recorded."""

    @cache
    def verdict(outcome: str, asserted: str, verdicts: str) -> str:
        alone = outcome if asserted == assertion else ""
        return verdicts_of({"verdicts": verdicts}).get(assertion, alone)

    told = (rows[name] for name in ("outcome", "assertion", "verdicts"))
    return pandas.Series(list(map(verdict, *told)), index=rows.index, dtype="object")


def _replay(batch: Batch, row: Mapping[Any, Any], assertion: str) -> str:
    """The failure, and the command that replays it."""
    command = shlex.join(["cavsumo", "replay", str(batch.csv_file), str(row["run"])])
    told = event(row) if row["assertion"] == assertion else f"{assertion} violated"
    judged = "" if batch.plan.reference == "none" else f", {failure_kind(row)}"
    return f"run {row['run']} (seed {row['seed']}){judged}: {told}: {command}"


def _standing(agent: str, found: EgoDriving) -> list[ET.Element]:
    """A case of its own for an ego that stood still or crawled, which no failure shows."""
    if not found.warning:
        return []
    case = ET.Element("testcase", classname=legal(agent), name="the ego drives")
    ET.SubElement(case, "skipped", message=legal(found.warning))
    return [case]


def _errors(agent: str, rows: pandas.DataFrame) -> list[ET.Element]:
    """A case of its own for the episodes that could not be played, if there are any."""
    errors = rows[rows["outcome"] == "error"]
    if not len(errors):
        return []
    case = ET.Element("testcase", classname=legal(agent), name="episodes can be played")
    told = [f"run {row['run']}: {row['error']}" for row in errors.head(SHOWN).to_dict("records")]
    message = f"{len(errors)} of {len(rows)} episodes could not be played; first: {told[0]}"
    result(case, "error", message, _with_rest(told, len(errors)), "error")
    return [case]


def _with_rest(told: Sequence[str], total: int) -> str:
    """The first messages, and the number of the others."""
    rest = total - len(told)
    return "\n".join([*told, *([f"and {rest} more"] if rest else [])])


def result(case: ET.Element, tag: str, message: str, text: str, sort: str) -> None:
    """The result of a case."""
    ET.SubElement(case, tag, message=legal(message), type=legal(sort)).text = legal(text)


def totals(parent: ET.Element, cases: Any) -> None:
    """The attributes that add cases up."""
    cases = list(cases)
    parent.set("tests", str(len(cases)))
    for attribute, tag in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
        parent.set(attribute, str(sum(case.find(tag) is not None for case in cases)))
    parent.set("time", f"{sum(float(case.get('time', 0)) for case in cases):.3f}")


def legal(text: str) -> str:
    """Text without characters that XML cannot hold."""
    return ILLEGAL.sub("�", text)
