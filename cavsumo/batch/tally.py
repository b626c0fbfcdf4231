"""The counts of a batch so far, row by row, in bounded memory."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from cavsumo.assertions.base import HELD, INVALID, UNFAIR, VIOLATED
from cavsumo.results.rows import cell, is_failure, is_test, verdicts_of
from cavsumo.results.statistics import Rate, rate, sequential_rate

Row = Mapping[str, Any]
RATES = ("tests", "failures")


@dataclass
class Found:
    """The counts of one agent.

    Attributes:
        outcomes: the number of episodes with each outcome.
        fresh: the number of rows of episodes in a simulation of their own.
        times: when tests were triggered, by time [s] to three decimals.
        verdicts: for each assertion, the number of episodes with each verdict.
        preventable: failures that the reference driver would have avoided (True) or not (False).
        forecasts: by forecast, the number of episodes with a test (True) and without.
    """

    outcomes: Counter[str] = field(default_factory=Counter)
    fresh: int = 0
    times: Counter[float] = field(default_factory=Counter)
    verdicts: dict[str, Counter[str]] = field(default_factory=dict)
    preventable: Counter[bool] = field(default_factory=Counter)
    forecasts: dict[str, Counter[bool]] = field(default_factory=dict)

    @property
    def episodes(self) -> int:
        """The number of episodes played."""
        return self.outcomes.total()

    @property
    def valid(self) -> int:
        """The number of valid episodes."""
        return self.episodes - self.errors - self.invalid

    @property
    def tests(self) -> int:
        """The number of tests."""
        return self.outcomes[HELD] + self.outcomes[VIOLATED]

    @property
    def failures(self) -> int:
        """The number of tests that the ego failed."""
        return self.outcomes[VIOLATED]

    @property
    def unfair(self) -> int:
        """The number of unfair episodes."""
        return self.outcomes[UNFAIR]

    @property
    def invalid(self) -> int:
        """The number of invalid episodes."""
        return self.outcomes[INVALID]

    @property
    def errors(self) -> int:
        """The number of error episodes."""
        return self.outcomes["error"]

    def rate(self, name: str, *, sequential: bool = False) -> Rate:
        """A rate: "tests" among valid episodes or "failures" among tests."""
        count, total = (self.tests, self.valid) if name == "tests" else (self.failures, self.tests)
        return sequential_rate(count, total) if sequential else rate(count, total)

    def median_time(self) -> float | None:
        """The median time of the triggers [s], None without any."""
        total = self.times.total()
        if not total:
            return None
        ordered = sorted(self.times.items())
        return (_nth(ordered, (total - 1) // 2) + _nth(ordered, total // 2)) / 2


class Tally:
    """Counts rows by agent.

    Attributes:
        agents: the counts of each agent, in the order in which they first appear.
        first: the first row of each kind: "failure", "test", "invalid", "error".
        rows: the number of rows.
    """

    def __init__(self) -> None:
        self.agents: dict[str, Found] = {}
        self.first: dict[str, Row] = {}
        self.rows = 0

    def add(self, row: Row) -> None:
        """Count one more row, as made or as read."""
        found = self.agents.setdefault(row["agent"], Found())
        self.rows += 1
        found.outcomes[row["outcome"]] += 1
        found.fresh += row.get("reset") == "fresh"
        for name, verdict in verdicts_of(row).items():
            found.verdicts.setdefault(name, Counter())[verdict] += 1
        if row.get("forecast"):
            found.forecasts.setdefault(row["forecast"], Counter())[is_test(row)] += 1
        if is_test(row):
            found.times[float(cell(row["trigger_time_s"]))] += 1
            self.first.setdefault("test", row)
        if is_failure(row):
            self.first.setdefault("failure", row)
            if cell(row.get("avoidable")):
                found.preventable[cell(row["avoidable"]) == "1"] += 1
        if row["outcome"] in ("error", INVALID):
            self.first.setdefault(row["outcome"], row)

    @property
    def all(self) -> Found:
        """The counts of all agents together."""
        return found_by(self.agents.values())


def found_by(agents: Iterable[Found]) -> Found:
    """The counts of several agents together, without the times."""
    together = Found()
    for found in agents:
        together.outcomes.update(found.outcomes)
        together.fresh += found.fresh
        together.preventable.update(found.preventable)
    return together


def tallied(rows: Iterable[Row]) -> Found:
    """The counts of some rows, of any agents."""
    tally = Tally()
    for row in rows:
        tally.add(row)
    return tally.all


def _nth(ordered: list[tuple[float, int]], n: int) -> float:
    """The n-th of values with multiplicities, in order."""
    for value, count in ordered:
        n -= count
        if n < 0:
            return value
    raise IndexError(n)
