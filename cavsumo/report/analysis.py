"""All figures of a report in one record, independent of their presentation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from cavsumo.report.compare import PairedComparison, comparisons, events
from cavsumo.report.distinct import Distinct, FailureCell, distinct, failure_cells
from cavsumo.report.driving import EgoDriving, driving
from cavsumo.report.effort import Effort, effort
from cavsumo.report.events import Described, described
from cavsumo.report.explored import Explored, explored
from cavsumo.report.grouping import Group, grouped
from cavsumo.report.load import Evidence, load
from cavsumo.report.rates import Rates, rates
from cavsumo.report.survival import TimeToTest, times_to_test


@dataclass(frozen=True)
class Report:
    """The evidence of some results.

    Attributes:
        by: the column that rows are grouped by besides their agents; "agent" for none.
        evidence: the rows and where they come from.
        groups: the rows told together.
        events: the failures that lead, preventable ones where all were judged, and tests.
        rates, driving, times, efforts, distinct: one entry a group, in the same order.
        comparisons: groups in pairs, on the same seeds.
        tests: what the traces tell of each test, by the index of its row.
        failures: failures that are alike, those that were preventable most often first.
        explored: what the searching agents among the groups have explored.
    """

    by: str
    evidence: Evidence
    groups: Sequence[Group]
    events: tuple[str, str]
    rates: Sequence[Rates]
    driving: Sequence[EgoDriving]
    comparisons: Sequence[PairedComparison]
    times: Sequence[TimeToTest]
    efforts: Sequence[Effort]
    distinct: Sequence[Distinct]
    tests: Mapping[int, Described]
    failures: Sequence[FailureCell]
    explored: Sequence[Explored]


def analyse(files: Sequence[Path], by: str = "agent") -> Report:
    """Read results and compute all figures of a report; raises InputError for wrong input."""
    evidence = load(files, by)
    groups = grouped(evidence, by)
    tests = described(evidence)
    return Report(
        by,
        evidence,
        groups,
        events(groups),
        [rates(group) for group in groups],
        [driving(group) for group in groups],
        comparisons(groups, by),
        times_to_test(groups),
        [effort(group) for group in groups],
        [distinct(group, tests, evidence.batches) for group in groups],
        tests,
        failure_cells(groups, tests, evidence.batches),
        [one for group in groups if (one := explored(group, evidence.batches))],
    )
