"""Groups compared in pairs, on the seeds that both of them played."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import pandas

from cavsumo.report.grouping import Group
from cavsumo.report.pairs import (
    Pairs,
    holm,
    mcnemar,
    ratio,
    ratio_interval,
    sequential_mcnemar,
    sequential_ratio_interval,
)
from cavsumo.results.statistics import Interval

# What is compared: of a valid episode, whether the ego failed preventably, failed at all, and
# whether it was a test.
EVENTS: dict[str, Callable[[pandas.DataFrame], pandas.Series]] = {
    "preventable": lambda rows: (rows["outcome"] == "violated") & (rows["avoidable"] == 1),
    "failures": lambda rows: rows["outcome"] == "violated",
    "tests": lambda rows: rows["outcome"].isin(("held", "violated")),
}
PAIRED = ["seed", "outcome", "avoidable"]  # columns by which episodes are paired and compared
WORDS = {"preventable": "preventable failures"}  # for events, where the name alone is too short


def events(groups: Sequence[Group]) -> tuple[str, str]:
    """The events that a report leads with: failures, preventable ones if all were judged, tests."""
    judged = all(group.reference for group in groups)
    return ("preventable" if judged else "failures"), "tests"


@dataclass(frozen=True)
class PairedComparison:
    """Two groups on the same seeds.

    Attributes:
        setting: which setting, if there are several.
        first, second: who is compared: agents, or values of the column for one agent.
        agent: the agent that both are of; empty when agents are compared.
        event: what is counted, one of ``EVENTS``.
        pairs: the pairs of valid episodes by what happened in them.
        ratio: the first's rate over the second's; infinite over none, None when neither has any.
        interval: its 95 % interval.
        p, p_holm: McNemar's p-value; the same adjusted for all comparisons of the report.
        sequential: interval and p-value are valid at any stopping time.
    """

    setting: str
    agent: str
    first: str
    second: str
    event: str
    pairs: Pairs
    ratio: float | None
    interval: Interval | None
    p: float
    p_holm: float
    sequential: bool


def comparisons(groups: Sequence[Group], by: str = "agent") -> list[PairedComparison]:
    """All pairs of groups that differ only in the column by which rows are grouped.

    The later one comes first, so that the other agents are compared with the first agent.
    """
    found = [
        _compared(later, earlier, event, by)
        for event in events(groups)
        for earlier, later in _comparable(groups, by)
    ]
    found = [comparison for comparison in found if comparison.pairs.total]
    adjusted = holm([comparison.p for comparison in found])
    return [replace(one, p_holm=p) for one, p in zip(found, adjusted, strict=True)]


def _comparable(groups: Sequence[Group], by: str) -> Iterator[tuple[Group, Group]]:
    """The pairs of groups to compare."""
    for one, other in itertools.combinations(groups, 2):
        if one.setting == other.setting and (by == "agent" or one.agent == other.agent):
            yield one, other


def _compared(first: Group, second: Group, event: str, by: str) -> PairedComparison:
    """One comparison, its p-value not yet adjusted."""
    pairs = paired(first, second, event)
    sequential = first.sequential or second.sequential
    return PairedComparison(
        first.setting,
        "" if by == "agent" else first.agent,
        first.agent if by == "agent" else first.value,
        second.agent if by == "agent" else second.value,
        event,
        pairs,
        ratio(pairs),
        (sequential_ratio_interval if sequential else ratio_interval)(pairs),
        (sequential_mcnemar if sequential else mcnemar)(pairs),
        1.0,
        sequential,
    )


def paired(first: Group, second: Group, event: str) -> Pairs:
    """Pair the episodes of equal seeds; a seed that either could not play is left out.

    A seed that one side has more than once (--by of a column that several settings share) pairs
    nothing and is left out as well.
    """
    happened = [
        EVENTS[event](valid).set_axis(valid["seed"])
        for valid in (
            group.valid_cells(PAIRED).drop_duplicates("seed", keep=False)
            for group in (first, second)
        )
    ]
    left, right = happened[0].align(happened[1], join="inner")
    return Pairs(
        int((left & right).sum()),
        int((left & ~right).sum()),
        int((~left & right).sum()),
        int((~left & ~right).sum()),
    )
