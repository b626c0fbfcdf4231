"""The results of a suite: what became of each case, and a line for each test.

A case is *avoided* if the ego touched nobody, else it has an impact: the speed of the ego at
contact, also as a share of the test's speed. The bands are shares of that speed; they are no score
of any protocol. A case that could not be played, or whose tester broke a rule of the world, is not
judged.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cavsumo.assertions.judgement import HELD, VIOLATED
from cavsumo.errors import InputError
from cavsumo.results.reading import whole_lines
from cavsumo.results.recorded_plan import recorded_plan
from cavsumo.results.rows import parameters_of
from cavsumo.suites.cases import cases_of

AVOIDED, NOT_JUDGED = "avoided", "not judged"
# Upper limits of the bands of the impact speed, as shares of the test's speed.
BANDS = ((0.25, "up to a quarter"), (0.5, "to half"), (0.75, "to three quarters"))
PREVENTABLE = "preventable"  # the parameter that says whether a reference avoids a case
ALLOWED = "allowed_kmh"  # and that which says how fast an impact may be
LAST_BAND = "above three quarters"


@dataclass(frozen=True)
class CaseResult:
    """The result of one case, or of a variation of it.

    Attributes:
        run: its number in the results.
        name: such as CPNA/30/50.
        variation: 0 for the case as published.
        avoided: whether the ego touched nobody; None if it is not judged.
        impact: speed of the ego at contact [km/h]; None without one.
        speed: of the test [km/h].
        why: why it is not judged.
        preventable: whether the reference of the suite avoids it; None where the suite has none.
        allowed: impact speed that the suite allows [km/h]; None where it says nothing.
    """

    run: int
    name: str
    variation: int
    avoided: bool | None
    impact: float | None
    speed: float
    why: str = ""
    preventable: bool | None = None
    allowed: float | None = None

    @property
    def within(self) -> bool:
        """Whether it is avoided, or its impact no faster than allowed."""
        return bool(self.avoided) or (self.impact or math.inf) <= (self.allowed or 0.0)

    @property
    def test(self) -> str:
        """The test to which it belongs."""
        return self.name.partition("/")[0]

    @property
    def share(self) -> float | None:
        """The impact speed as a share of the test's speed."""
        return None if self.impact is None or not self.speed else self.impact / self.speed

    @property
    def band(self) -> str:
        """The band in which it lies."""
        if self.avoided is None:
            return NOT_JUDGED
        if self.avoided or self.share is None:
            return AVOIDED
        return next((name for limit, name in BANDS if self.share <= limit + 1e-6), LAST_BAND)


@dataclass(frozen=True)
class SuiteTestResult:
    """The result of one test, or of all.

    Attributes:
        test: its name.
        cases: how many are judged.
        avoided: how many of those are avoided.
        mean_impact, worst_impact: speeds of the ego at contact [km/h]; None without one.
        mean_share: the same as a share of the test's speed, 0 for an avoided case; None without
            a case.
        not_judged: how many are not judged.
        preventable: impacts that the reference of the suite avoids; None where the suite has none.
        within: cases within the limit of the suite; None where it has none.
    """

    test: str
    cases: int
    avoided: int
    mean_impact: float | None
    worst_impact: float | None
    mean_share: float | None
    not_judged: int
    preventable: int | None = None
    within: int | None = None


@dataclass(frozen=True)
class SuiteTold:
    """The words of a page about a suite: titles, the ego, the results file, the tests' titles, and
    the parameters in the names of their cases.
    """

    title: str
    source: str
    ego: str
    file: str
    tests: dict[str, str]
    named_by: dict[str, tuple[str, ...]] = field(default_factory=dict)


def told_of(file: Path) -> SuiteTold:
    """The words about the suite in a results file."""
    plan, _ = recorded_plan(file)
    suite = cases_of(plan).suite
    titles = {test.name: test.title for test in suite.tests}
    named_by = {test.name: test.case for test in suite.tests}
    return SuiteTold(suite.title, suite.source, plan.scenario.ego, file.name, titles, named_by)


def cases_in(file: Path) -> list[CaseResult]:
    """The results of the cases in a results file; InputError where it is of no suite."""
    plan, _ = recorded_plan(file)
    if plan.suite is None:
        raise InputError(f"results {str(file)!r}: of no suite; its cases would be listed")
    rows = (row for _, row in whole_lines(file) if row is not None)
    return case_results(rows, cases_of(plan).suite.speed)


def case_results(rows: Iterable[Mapping[str, Any]], speed: str = "ego_kmh") -> list[CaseResult]:
    """The results of the rows that belong to a suite.

    ``speed``: the parameter that holds the speed of the test [km/h].
    """
    return [_case(row, speed) for row in rows if row.get("case")]


def _case(row: Mapping[str, Any], speed: str) -> CaseResult:
    """The result of one row."""
    parameters, outcome = parameters_of(row), row["outcome"]
    judged = outcome in (HELD, VIOLATED)
    impact = float(row["ego_speed_mps"]) * 3.6 if outcome == VIOLATED else None
    why = "" if judged else str(row.get("error") or row.get("breach") or outcome)
    return CaseResult(
        int(row["run"]),
        str(row["case"]),
        int(parameters.get("variation", 0)),
        outcome == HELD if judged else None,
        impact,
        float(parameters.get(speed, "nan")),
        why,
        float(parameters[PREVENTABLE]) > 0.5 if PREVENTABLE in parameters else None,
        float(parameters[ALLOWED]) if ALLOWED in parameters else None,
    )


def result_of(test: str, cases: Sequence[CaseResult]) -> SuiteTestResult:
    """The result of some cases together."""
    judged = [case for case in cases if case.avoided is not None]
    impacts = [case.impact for case in judged if case.impact is not None]
    shares = [case.share or 0.0 for case in judged]
    told = [case for case in judged if case.preventable is not None]
    limited = [case for case in judged if case.allowed is not None]
    return SuiteTestResult(
        test,
        len(judged),
        sum(bool(case.avoided) for case in judged),
        sum(impacts) / len(impacts) if impacts else None,
        max(impacts, default=None),
        sum(shares) / len(shares) if shares else None,
        len(cases) - len(judged),
        sum(case.impact is not None for case in told if case.preventable) if told else None,
        sum(case.within for case in limited) if limited else None,
    )


def results_of_tests(cases: Sequence[CaseResult]) -> list[SuiteTestResult]:
    """A result for each test, in order of appearance, and one for all of several."""
    tests = list(dict.fromkeys(case.test for case in cases))
    found = [result_of(test, [case for case in cases if case.test == test]) for test in tests]
    return found if len(tests) < 2 else [*found, result_of("all", cases)]


def suite_table(cases: Sequence[CaseResult]) -> str:
    """The table at the end of a suite: a line for each test."""
    head = ["test", "cases", "avoided", "share", "mean impact", "worst impact", "of test speed"]
    results = results_of_tests(cases)
    rows = [head, *(_cells(one) for one in results)]
    if any(one.preventable is not None for one in results):
        _append(rows, "preventable", [one.preventable for one in results])
    if any(one.within is not None for one in results):
        _append(rows, "within limit", [one.within for one in results])
    if any(one.not_judged for one in results):
        _append(rows, "not judged", [one.not_judged for one in results])
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(
            f"{word:{width}}" if i == 0 else f"{word:>{width}}"
            for i, (word, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    )


def _append(rows: list[list[str]], title: str, numbers: Sequence[int | None]) -> None:
    """Add a column of counts."""
    for row, word in zip(rows, [title, *numbers], strict=True):
        row.append("" if word is None else str(word))


def _cells(one: SuiteTestResult) -> list[str]:
    """The cells of a line."""
    share = f"{one.avoided / one.cases:.0%}" if one.cases else ""
    impacts = [
        f"{v:.1f} km/h" if v is not None else "" for v in (one.mean_impact, one.worst_impact)
    ]
    of_speed = "" if one.mean_share is None else f"{one.mean_share:.0%}"
    return [one.test, str(one.cases), str(one.avoided), share, *impacts, of_speed]
