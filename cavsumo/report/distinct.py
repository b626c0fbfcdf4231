"""The number of distinct tests and failures: cells of speed, side, place and kind of tester.

Two tests are alike if they lie in the same cell. The number of cells not yet found is estimated
from those found once (Good and Turing: Good 1953, Biometrika 40, 237) or once and twice (Chao 1984,
Scand. J. Stat. 11, 265).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from cavsumo.report.events import Described, Event
from cavsumo.report.grouping import Group, Told
from cavsumo.report.load import Batch

SPEED_BIN, PLACE_BIN = 2.0, 10.0  # m/s, m


class Cell(NamedTuple):
    """The features that two similar tests share.

    Attributes:
        setting: the setting, if there are several.
        kind: kind of tester.
        side: of the ego.
        speed, place: lower bounds of the closing speed [m/s] and of the ego's way so far [m].
    """

    setting: str
    kind: str
    side: str
    speed: float
    place: float


@dataclass(frozen=True)
class Diversity:
    """The numbers of cells.

    Attributes:
        total: number of tests, or failures.
        known: number of those whose cell is known.
        cells: number of their cells.
        estimate: Chao's lower bound on the number of all cells, found or not; None when none is
            known.
        new: Good and Turing's estimate of the share of the next ones in a new cell; None likewise.
    """

    total: int
    known: int
    cells: int
    estimate: float | None
    new: float | None


@dataclass(frozen=True)
class Distinct(Told):
    """The diversity of the tests and of the failures of a group.

    Attributes:
        tests: at their triggers.
        failures: at their impacts.
    """

    tests: Diversity
    failures: Diversity


@dataclass(frozen=True)
class FailureCell:
    """Similar failures of all agents together.

    Attributes:
        cell: their cell.
        count: their number.
        file, run: the first of them.
        agents: the agents that found them.
    """

    cell: Cell
    count: int
    file: str
    run: int
    agents: tuple[str, ...]


def cell_of(event: Event, kind: str, setting: str) -> Cell | None:
    """The cell of an event, None when anything of it is not known."""
    if event.speed is None or event.side is None or event.place is None:
        return None
    speed, place = _floor(event.speed, SPEED_BIN), _floor(event.place, PLACE_BIN)
    return Cell(setting, kind, event.side, speed, place)


def _floor(value: float, width: float) -> float:
    """The lower bound of the bin that a value lies in."""
    return math.floor(value / width + 1e-9) * width


def distinct(group: Group, tests: Mapping[int, Described], batches: tuple[Batch, ...]) -> Distinct:
    """The diversity of the tests and failures of a group."""
    found = [
        (tests[int(index)], batches[batch].plan.scenario.kind)
        for index, batch in group.rows["batch"].items()
        if int(index) in tests
    ]
    triggers = [cell_of(test.trigger, kind, "") for test, kind in found]
    impacts = [cell_of(test.impact, kind, "") for test, kind in found if test.impact is not None]
    return Distinct(*group.whose, tests=diversity(triggers), failures=diversity(impacts))


def diversity(cells: Iterable[Cell | None]) -> Diversity:
    """The number of cells, found and estimated.

    Chao's bound with the correction of its bias: S + f1 (f1 - 1) / (2 (f2 + 1)), where f1 and f2
    are the numbers of cells found once and twice.
    """
    cells = list(cells)
    counts = Counter(cell for cell in cells if cell is not None)
    known, often = counts.total(), Counter(counts.values())
    if not known:
        return Diversity(len(cells), 0, 0, None, None)
    estimate = len(counts) + often[1] * (often[1] - 1) / (2 * (often[2] + 1))
    return Diversity(len(cells), known, len(counts), estimate, often[1] / known)


def failure_cells(
    groups: Iterable[Group], tests: Mapping[int, Described], batches: tuple[Batch, ...]
) -> list[FailureCell]:
    """The cells of all failures, the most frequent first."""
    members: dict[Cell, list[tuple[str, int, str]]] = {}
    for group in groups:
        rows = group.rows[group.rows["outcome"] == "violated"]
        for row in rows[["batch", "file", "run", "agent"]].itertuples():
            impact = tests[int(row.Index)].impact
            kind = batches[row.batch].plan.scenario.kind
            cell = cell_of(impact, kind, group.setting) if impact is not None else None
            if cell is not None:
                members.setdefault(cell, []).append((row.file, int(row.run), row.agent))
    found = [
        FailureCell(
            cell, len(rows), *min(rows)[:2], agents=tuple(dict.fromkeys(a for *_, a in rows))
        )
        for cell, rows in members.items()
    ]
    return sorted(found, key=lambda f: (-f.count, f.file, f.run))
