"""The number of distinct tests and failures: cells of speed, side, place and kind of tester.

Two tests are alike if they lie in the same cell. Side and place are those of the results
(``from_side``, ``meets_m``), as a search counts its failures (``results.alike``); the speed is that
of an impact, and of a test the closing speed at its trigger, from its trace. Results before 0.2
lack the columns: there, all of it comes from the traces. The number of cells not yet found is
estimated from those found once (Good and Turing: Good 1953, Biometrika 40, 237) or once and twice
(Chao 1984, Scand. J. Stat. 11, 265).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import pandas

from cavsumo.report.events import Described, Event
from cavsumo.report.grouping import Group, Told
from cavsumo.report.load import Batch
from cavsumo.results.alike import FEATURES, PLACE_BIN_M, SPEED_BIN_MPS, bin_of, kind_of
from cavsumo.results.failures import ORDER, failure_kind

JUDGED = ("outcome", "avoidable")  # columns that say whether a failure was preventable
USED = (*JUDGED, *FEATURES, "batch", "file", "run", "agent")


class Cell(NamedTuple):
    """The features that two similar tests share.

    Attributes:
        setting: the setting, if there are several.
        kind: kind of tester.
        side: from which the tester came; of old results the side of the ego where it was.
        speed, place: lower bounds of the closing speed [m/s] and of where it meets the ego's path,
            or of old results of the ego's way so far [m].
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
        preventable, failures: at their impacts.
        tests: at their triggers.
    """

    preventable: Diversity
    tests: Diversity
    failures: Diversity


@dataclass(frozen=True)
class FailureCell:
    """Similar failures of all agents together.

    Attributes:
        cell: what they have in common.
        count, preventable: how many there are, how many of them were preventable.
        file, run: the first of them, a preventable one if there is any.
        agents: who found them.
    """

    cell: Cell
    count: int
    preventable: int
    file: str
    run: int
    agents: tuple[str, ...]


def cell_of(event: Event, kind: str, setting: str) -> Cell | None:
    """The cell of an event, None when anything of it is not known."""
    if event.speed is None or event.side is None or event.place is None:
        return None
    speed, place = bin_of(event.speed, SPEED_BIN_MPS), bin_of(event.place, PLACE_BIN_M)
    return Cell(setting, kind, event.side, speed, place)


def failure_cell(row: Mapping[str, Any], test: Described, kind: str, setting: str) -> Cell | None:
    """The cell of a failure, from its row; None when anything of it is not known."""
    if _has_course(row):
        speed, side, place = kind_of(row)
        return Cell(setting, kind, side, speed, place)
    return None if test.impact is None else cell_of(test.impact, kind, setting)


def _test_cell(row: Mapping[str, Any], test: Described, kind: str) -> Cell | None:
    """The cell of a test at its trigger; None when anything of it is not known."""
    trigger = test.trigger
    if _has_course(row):
        trigger = trigger._replace(side=row["from_side"], place=row["meets_m"])
    return cell_of(trigger, kind, "")


def _has_course(row: Mapping[str, Any]) -> bool:
    """Whether a row says from where the tester came."""
    return bool(row["from_side"]) and not math.isnan(row["meets_m"])


def distinct(group: Group, tests: Mapping[int, Described], batches: tuple[Batch, ...]) -> Distinct:
    """How different the tests and failures of a group are."""
    triggers, impacts, preventable = [], [], []
    rows = group.rows[group.rows["outcome"].isin(("held", "violated"))]
    for index, row in _told(rows):
        test, kind = tests[index], batches[row["batch"]].plan.scenario.kind
        triggers.append(_test_cell(row, test, kind))
        if row["outcome"] == "violated":
            impacts.append(failure_cell(row, test, kind, ""))
            preventable += impacts[-1:] if row["avoidable"] == 1 else []
    return Distinct(*group.whose, *map(diversity, (preventable, triggers, impacts)))


def _told(rows: pandas.DataFrame) -> Iterator[tuple[int, dict[str, Any]]]:
    """The index of each row, and what is used of it."""
    cells = zip(*(rows[name] for name in USED), strict=True)
    for index, values in zip(rows.index.tolist(), cells, strict=True):
        yield index, dict(zip(USED, values, strict=True))


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
    """The cells of all failures, those that were preventable most often first."""
    members: dict[Cell, list[tuple[int, str, int, str]]] = {}
    for group in groups:
        for index, row in _told(group.rows[group.rows["outcome"] == "violated"]):
            kind = batches[row["batch"]].plan.scenario.kind
            cell = failure_cell(row, tests[index], kind, group.setting)
            if cell is not None:
                order = ORDER.index(failure_kind(row))
                members.setdefault(cell, []).append(
                    (order, row["file"], int(row["run"]), row["agent"])
                )
    found = [
        FailureCell(
            cell,
            len(rows),
            sum(order == 0 for order, *_ in rows),
            *min(rows)[1:3],
            agents=tuple(dict.fromkeys(a for *_, a in rows)),
        )
        for cell, rows in members.items()
    ]
    return sorted(found, key=lambda f: (-f.preventable, -f.count, f.file, f.run))
