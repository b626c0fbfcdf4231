"""The counts of a batch so far, row by row, in bounded memory."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import compress, islice
from typing import TYPE_CHECKING, Any

from cavsumo.assertions.base import HELD, INVALID, UNFAIR, VIOLATED
from cavsumo.results.failures import NOT_JUDGED, ORDER, PREVENTABLE, UNPREVENTABLE, failure_kind
from cavsumo.results.rows import cell, is_test, verdicts_of
from cavsumo.results.statistics import Rate, rate, sequential_rate

if TYPE_CHECKING:
    from cavsumo.results.kaplan_meier import Curve

Row = Mapping[str, Any]
Columns = Mapping[str, Sequence[Any]]  # cells by column, one each row
AT_ONCE = 10_000  # rows that are in memory while they are counted
RATES = ("tests", "preventable", "failures")
ERROR, TESTS = "error", (HELD, VIOLATED)
JUDGED = ("avoidable", "avoidable_ideal")
DRIVES = ("arrived", "lost_s", "frozen")
KINDS = ("outcome", "avoidable", "frozen")  # columns that say what a row can be the first of
# Columns that are counted.
COUNTED = (
    *("agent", "outcome", "verdicts", "forecast", "trigger_time_s", "time_s"),
    *(*JUDGED, *DRIVES),
)


@dataclass
class Found:
    """The counts of one agent.

    Attributes:
        outcomes: the number of episodes with each outcome.
        times: when tests were triggered, by time [s] to three decimals.
        censored: when valid episodes without a test ended, likewise.
        verdicts: for each assertion, how often it said what.
        kinds: failures by ``failures.failure_kind``.
        ideal: of the unpreventable ones, how many the ideal driver would have avoided (True) or
            not, as far as it was asked.
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
    ideal: Counter[bool] = field(default_factory=Counter)
    arrivals: Counter[bool] = field(default_factory=Counter)
    lost_s: float = 0.0
    compared: int = 0
    frozen: Counter[str] = field(default_factory=Counter)
    forecasts: dict[str, Counter[bool]] = field(default_factory=dict)

    def count(self, columns: Columns) -> None:
        """Count rows given by columns, all of ``COUNTED``, as made, as read or as numbers."""
        outcomes = columns["outcome"]
        self.outcomes.update(outcomes)
        for said, count in Counter(columns["verdicts"]).items():
            for name, verdict in verdicts_of({"verdicts": said}).items():
                self.verdicts.setdefault(name, Counter())[verdict] += count
        tests = [outcome in TESTS for outcome in outcomes]
        for (said, test), count in Counter(zip(columns["forecast"], tests, strict=True)).items():
            if said:
                self.forecasts.setdefault(said, Counter())[test] += count
        self.times.update(_times(compress(columns["trigger_time_s"], tests)))
        ended = [outcome not in (*TESTS, ERROR, INVALID) for outcome in outcomes]
        self.censored.update(_times(compress(columns["time_s"], ended)))
        self._count_failures(columns)
        self._count_drives(columns, [test or end for test, end in zip(tests, ended, strict=True)])

    def _count_failures(self, columns: Columns) -> None:
        """Count failures by who would have avoided them."""
        failed = [outcome == VIOLATED for outcome in columns["outcome"]]
        judged = (map(cell, compress(columns[name], failed)) for name in JUDGED)
        for (avoidable, ideal), count in Counter(zip(*judged, strict=True)).items():
            kind = failure_kind({"outcome": VIOLATED, "avoidable": avoidable})
            self.kinds[kind] += count
            if kind == UNPREVENTABLE and ideal:
                self.ideal[float(ideal) == 1.0] += count

    def _count_drives(self, columns: Columns, valid: Sequence[bool]) -> None:
        """Count how the ego came along in valid episodes."""
        arrived, lost, frozen = (compress(columns[name], valid) for name in DRIVES)
        for value, count in Counter(arrived).items():
            if said := cell(value):
                self.arrivals[float(said) == 1.0] += count
        for text in filter(None, map(cell, lost)):
            self.lost_s += float(text)  # in the order of the rows: sums of floats depend on it
            self.compared += 1
        for value, count in Counter(frozen).items():
            if said := cell(value):
                self.frozen[said] += count

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
        return self.outcomes[ERROR]

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
        self._seen: set[tuple[Any, ...]] = set()

    def add(self, row: Row) -> None:
        """Count one more row, as made or as read."""
        self.add_rows([row])

    def add_rows(self, rows: Iterable[Row]) -> None:
        """Count rows; many are counted faster together."""
        rows = iter(rows)
        while some := list(islice(rows, AT_ONCE)):
            self.add_all({n: [row.get(n) for row in some] for n in COUNTED}, some.__getitem__)

    def add_all(self, columns: Columns, row: Callable[[int], Row]) -> None:
        """Count rows given by columns, all of ``COUNTED``; ``row`` gives one of them by its place.

        The same as each of them by ``add``, in the order of the rows.
        """
        agents = columns["agent"]
        self.rows += len(agents)
        for agent in dict.fromkeys(agents):
            found = self.agents.setdefault(agent, Found())
            own = [one == agent for one in agents]
            found.count({name: list(compress(columns[name], own)) for name in COUNTED})
        self._note_first(columns, row)

    def _note_first(self, columns: Columns, row: Callable[[int], Row]) -> None:
        """Note the first rows of their kinds."""
        for place, told in enumerate(zip(*(columns[name] for name in KINDS), strict=True)):
            if told not in self._seen:
                self._seen.add(told)
                for kind in _kinds(dict(zip(KINDS, told, strict=True))):
                    if kind not in self.first:
                        self.first[kind] = row(place)

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
        together.ideal.update(found.ideal)
        together.arrivals.update(found.arrivals)
        together.lost_s += found.lost_s
        together.compared += found.compared
        together.frozen.update(found.frozen)
    return together


def _kinds(row: Row) -> Iterator[str]:
    """The kinds of which a row can be the first."""
    if row["outcome"] in (ERROR, INVALID):
        yield row["outcome"]
        return
    if is_test(row):
        yield "test"
    if kind := failure_kind(row):
        yield kind
    if cell(row["frozen"]):
        yield "frozen"


def _times(cells: Iterable[Any]) -> Counter[float]:
    """How often there are which times [s], as the CSV has them."""
    found: Counter[float] = Counter()
    for text, count in Counter(map(cell, cells)).items():
        found[float(text)] += count
    return found
