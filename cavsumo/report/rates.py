"""The results of a group, as shares with intervals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cavsumo.assertions.base import VIOLATED
from cavsumo.batch.sentences import by_ideal
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
        episodes, invalid, errors: how many there are, in how many a tester broke the rules of the
            world, how many could not be played.
        preventable: failures that the reference driver would have avoided, of tests.
        tests, failures, unfair: of valid episodes, of tests, of valid episodes.
        unpreventable: failures that it would not have avoided, of tests.
        by_ideal: those of them that an ideal driver would have avoided, of tests; None if that was
            not judged.
        not_judged: how many failures nobody judged.
        reference: who judged, empty if not all failures were judged.
        blame: by the rule broken first, as ``party:rule``, the most frequent first: of failures.
    """

    episodes: int
    invalid: int
    errors: int
    preventable: Share
    tests: Share
    failures: Share
    unfair: Share
    unpreventable: Share
    by_ideal: Share | None
    not_judged: int
    reference: str
    blame: Mapping[str, Share]


def rates(group: Group) -> Rates:
    """The shares of one group."""
    found, ideal = group.found, by_ideal(group.found, group.reference)
    failed = group.rows[group.rows["outcome"] == VIOLATED]

    def of(name: str, total: str, words: str) -> Share:
        whole = getattr(found, total)
        return share(getattr(found, name), whole, words, sequential=group.sequential)

    return Rates(
        *group.whose,
        episodes=found.episodes,
        invalid=found.invalid,
        errors=found.errors,
        preventable=of("preventable", "tests", "tests"),
        tests=of("tests", "valid", "valid episodes"),
        failures=of("failures", "tests", "tests"),
        unfair=of("unfair", "valid", "valid episodes"),
        unpreventable=of("unpreventable", "tests", "tests"),
        by_ideal=None
        if ideal is None
        else share(ideal, found.tests, "tests", sequential=group.sequential),
        not_judged=found.not_judged,
        reference=group.reference,
        blame={
            rule or NO_RULE: share(count, found.failures, "failures", sequential=group.sequential)
            for rule, count in failed["blame"].astype("object").value_counts().items()
        },
    )


def share(count: int, total: int, of: str, *, sequential: bool) -> Share:
    """A share with its valid intervals."""
    if sequential:
        return Share(count, total, of, {SEQUENTIAL: sequential_rate(count, total)})
    both = {WILSON: rate(count, total), EXACT: rate(count, total, "exact")}
    return Share(count, total, of, both)
