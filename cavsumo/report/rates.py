"""What a group found, as shares with intervals."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from cavsumo.report.grouping import Group, Told
from cavsumo.statistics import Rate, rate, sequential_rate
from cavsumo.tally import Found

WILSON, EXACT, SEQUENTIAL = "Wilson", "Clopper-Pearson", "confidence sequence"


@dataclass(frozen=True)
class Share:
    """A share of something, with its 95 % intervals by the names of the methods.

    Attributes:
        count, total: how many of how many.
        of: of what.
        intervals: by Wilson and by Clopper and Pearson; or, where the number of episodes may depend
            on what they found, the confidence sequence alone, for the others would not hold.
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
        episodes, errors: how many there are, how many could not be played.
        tests, failures, unfair: of valid episodes, of tests, of valid episodes.
    """

    episodes: int
    errors: int
    tests: Share
    failures: Share
    unfair: Share


def rates(group: Group) -> Rates:
    """The shares of one group."""
    found = Found(Counter(group.rows["outcome"]))
    sequential = group.sequential
    return Rates(
        *group.whose,
        episodes=found.episodes,
        errors=found.errors,
        tests=share(found.tests, found.valid, "valid episodes", sequential=sequential),
        failures=share(found.failures, found.tests, "tests", sequential=sequential),
        unfair=share(found.unfair, found.valid, "valid episodes", sequential=sequential),
    )


def share(count: int, total: int, of: str, *, sequential: bool) -> Share:
    """A share with the intervals that hold for it."""
    if sequential:
        return Share(count, total, of, {SEQUENTIAL: sequential_rate(count, total)})
    both = {WILSON: rate(count, total), EXACT: rate(count, total, "exact")}
    return Share(count, total, of, both)
