"""The counts of a batch so far, row by row, in bounded memory."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from cavsumo.assertions.base import HELD, INVALID, UNFAIR, VIOLATED
from cavsumo.results.failures import NOT_JUDGED, ORDER, PREVENTABLE, UNPREVENTABLE, failure_kind
from cavsumo.results.rows import cell, is_test, verdicts_of
from cavsumo.results.statistics import Rate, rate, sequential_rate

if TYPE_CHECKING:
    from cavsumo.results.kaplan_meier import Curve

Row = Mapping[str, Any]
RATES = ("tests", "preventable", "failures")


@dataclass
class Found:
    """The counts of one agent.

    Attributes:
        outcomes: the number of episodes with each outcome.
        times: when tests were triggered, by time [s] to three decimals.
        censored: when valid episodes without a test ended, likewise.
        verdicts: for each assertion, how often it said what.
        kinds: failures by ``failures.failure_kind``.
        arrivals: in how many episodes that no verdict ended the ego arrived (True) or not.
        lost_s, compared: time lost against the free drive [s], and in how many episodes.
        frozen: how often the ego stood still or crawled, by the column's word.
        forecasts: by what was said before the episode, in how many there was a test (True) or not.
    """

    outcomes: Counter[str] = field(default_factory=Counter)
    times: Counter[float] = field(default_factory=Counter)
    censored: Counter[float] = field(default_factory=Counter)
    verdicts: dict[str, Counter[str]] = field(default_factory=dict)
    kinds: Counter[str] = field(default_factory=Counter)
    arrivals: Counter[bool] = field(default_factory=Counter)
    lost_s: float = 0.0
    compared: int = 0
    frozen: Counter[str] = field(default_factory=Counter)
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
        """How many tests the ego failed, whether that was preventable or not."""
        return self.outcomes[VIOLATED]

    @property
    def preventable(self) -> int:
        """How many failures the reference driver would have avoided."""
        return self.kinds[PREVENTABLE]

    @property
    def unpreventable(self) -> int:
        """How many it would not have avoided."""
        return self.kinds[UNPREVENTABLE]

    @property
    def not_judged(self) -> int:
        """How many failures nobody judged."""
        return self.kinds[NOT_JUDGED]

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
        """A rate, one of ``RATES``: tests among valid episodes, failures among tests."""
        count, total = getattr(self, name), self.valid if name == "tests" else self.tests
        return sequential_rate(count, total) if sequential else rate(count, total)

    def curve(self) -> Curve | None:
        """The share of valid episodes without a test so far; None without episodes."""
        import numpy as np

        from cavsumo.results.kaplan_meier import kaplan_meier

        tests, others = (
            np.repeat(list(map(float, counts)), list(counts.values()))
            for counts in (self.times, self.censored)
        )
        happened = np.arange(len(tests) + len(others)) < len(tests)
        return kaplan_meier(np.concatenate([tests, others]), happened)


class Tally:
    """Counts rows by agent.

    Attributes:
        agents: what each agent found, in the order in which they first appear.
        first: the first row of each kind: of failure, "test", "frozen", "invalid", "error".
        rows: how many rows there were.
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
        for name, verdict in verdicts_of(row).items():
            found.verdicts.setdefault(name, Counter())[verdict] += 1
        if row.get("forecast"):
            found.forecasts.setdefault(row["forecast"], Counter())[is_test(row)] += 1
        if row["outcome"] in ("error", INVALID):
            self.first.setdefault(row["outcome"], row)
            return
        if is_test(row):
            found.times[float(cell(row["trigger_time_s"]))] += 1
            self.first.setdefault("test", row)
        else:
            found.censored[float(cell(row["time_s"]))] += 1
        if kind := failure_kind(row):
            found.kinds[kind] += 1
            self.first.setdefault(kind, row)
        self._add_drive(found, row)

    def _add_drive(self, found: Found, row: Row) -> None:
        """Count how the ego came along in a valid episode."""
        arrived, lost, frozen = (cell(row.get(c)) for c in ("arrived", "lost_s", "frozen"))
        if arrived:
            found.arrivals[float(arrived) == 1.0] += 1
        if lost:
            found.lost_s += float(lost)
            found.compared += 1
        if frozen:
            found.frozen[frozen] += 1
            self.first.setdefault("frozen", row)

    def facts(self) -> dict[str, Any]:
        """The counts, for the manifest: episodes by outcome, failures by kind."""
        found = self.all
        kinds = {kind: found.kinds[kind] for kind in ORDER if found.kinds[kind]}
        return {"episodes": self.rows, "counts": found.outcomes, "failures": kinds}

    @property
    def all(self) -> Found:
        """The counts of all agents together."""
        return found_by(self.agents.values())


def found_by(agents: Iterable[Found]) -> Found:
    """The counts of several agents together, without the times."""
    together = Found()
    for found in agents:
        together.outcomes.update(found.outcomes)
        together.kinds.update(found.kinds)
        together.arrivals.update(found.arrivals)
        together.lost_s += found.lost_s
        together.compared += found.compared
        together.frozen.update(found.frozen)
    return together


def tallied(rows: Iterable[Mapping[Any, Any]]) -> Found:
    """The counts of some rows, of any agents."""
    tally = Tally()
    for row in rows:
        tally.add(row)
    return tally.all
