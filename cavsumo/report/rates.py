"""The results of a group, as shares with intervals."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from cavsumo.assertions.base import VIOLATED
from cavsumo.batch.tally import Found
from cavsumo.report.grouping import Group, Told
from cavsumo.results.statistics import Rate, rate, sequential_rate

NO_RULE = "no rule"  # the rules of ``blame``
WILSON, EXACT, SEQUENTIAL = "Wilson", "Clopper-Pearson", "confidence sequence"


@dataclass(frozen=True)
class Share:
    """A share of something, with its 95 % intervals by the names of the methods.

    Attributes:
        count, total: the numbers.
        of: the meaning of the total.
        intervals: by Wilson and by Clopper and Pearson; or, if the number of episodes may depend on
            their results, the confidence sequence alone, because the others would not be valid.
    """

    count: int
    total: int
    of: str
    intervals: Mapping[str, Rate]

    @property
    def value(self) -> float | None:
        """The share, None of nothing."""
        return self.count / self.total if self.total else None


@dataclass(frozen=True)
class Rates(Told):
    """The shares of one group.

    Attributes:
        episodes, invalid, errors: numbers of episodes, of those in which a tester broke the rules
            of the world, of those that could not be played.
        tests, failures, unfair: of valid episodes, of tests, of valid episodes.
        preventable: failures that the reference driver would have avoided, of those judged.
        reference: its name, empty if none was judged.
        blame: by the rule broken first, as ``party:rule``, the most frequent first: of failures.
    """

    episodes: int
    invalid: int
    errors: int
    tests: Share
    failures: Share
    unfair: Share
    preventable: Share
    reference: str
    blame: Mapping[str, Share]


def rates(group: Group) -> Rates:
    """The shares of one group."""
    found = Found(Counter(group.rows["outcome"]))
    sequential = group.sequential
    judged = group.rows[group.rows["avoidable"].notna()]
    failed = group.rows[group.rows["outcome"] == VIOLATED]
    return Rates(
        *group.whose,
        episodes=found.episodes,
        invalid=found.invalid,
        errors=found.errors,
        tests=share(found.tests, found.valid, "valid episodes", sequential=sequential),
        failures=share(found.failures, found.tests, "tests", sequential=sequential),
        unfair=share(found.unfair, found.valid, "valid episodes", sequential=sequential),
        preventable=share(
            int((judged["avoidable"] == 1).sum()),
            len(judged),
            "judged failures",
            sequential=sequential,
        ),
        reference=", ".join(judged["reference"].unique()),
        blame={
            rule or NO_RULE: share(count, found.failures, "failures", sequential=sequential)
            for rule, count in failed["blame"].value_counts().items()
        },
    )


def share(count: int, total: int, of: str, *, sequential: bool) -> Share:
    """A share with its valid intervals."""
    if sequential:
        return Share(count, total, of, {SEQUENTIAL: sequential_rate(count, total)})
    both = {WILSON: rate(count, total), EXACT: rate(count, total, "exact")}
    return Share(count, total, of, both)
