"""The cells that a search has explored, of place, side and speed, each with its best grade.

And its failures in groups that are alike, as the search itself counts them (``results.alike``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pandas

from cavsumo.batch.plan_names import searching
from cavsumo.model.bodies import kind_named
from cavsumo.report.grouping import Group, Told
from cavsumo.report.load import Batch
from cavsumo.results.alike import FEATURES, PLACE_BIN_M, bin_of, kind_of
from cavsumo.results.failures import PREVENTABLE, UNPREVENTABLE, failure_kind

SPEEDS = 4  # bins up to the top speed of the kind
SIDES = ("left", "right", "ahead")
# From a grade on: how near an episode came to a preventable failure (``results.grade``).
BANDS = (
    (0.0, PREVENTABLE),
    (-1.0, UNPREVENTABLE),
    (-2.0, "held"),
    (-3.0, "unfair"),
    (-4.0, "missed"),
    (-math.inf, "invalid"),
)


@dataclass(frozen=True)
class ExploredCell:
    """The tests of one cell.

    Attributes:
        side: from which the testers came.
        speed, place: lower bounds of their speed [m/s] and of where they meet the ego's path [m].
        count: number of tests.
        grade: the best.
        band: its meaning, of ``BANDS``.
        index: of the row of the best.
    """

    side: str
    speed: float
    place: float
    count: int
    grade: float
    band: str
    index: int


@dataclass(frozen=True)
class AlikeFailures:
    """Failures of a search that are alike.

    Attributes:
        side, impact, place: what they share: side, lower bounds of impact speed [m/s] and place
            [m].
        slowest, fastest: the testers' speeds [m/s]; None where no one moved on the road.
        count, preventable: how many there are, how many of them were preventable.
        indices: of their rows, the best first.
    """

    side: str
    impact: float
    place: float
    slowest: float | None
    fastest: float | None
    count: int
    preventable: int
    indices: Sequence[int]


@dataclass(frozen=True)
class Explored(Told):
    """The tests of one searching agent.

    Attributes:
        cells: those with a test, in no order.
        sides, speeds, places: the bins of all axes, without gaps in speed and place.
        speed_step: width of a bin of speed [m/s].
        unmoved: number of tests without a cell: no tester moved on the road.
        failures: in groups that are alike, preventable ones first.
    """

    cells: Sequence[ExploredCell]
    sides: Sequence[str]
    speeds: Sequence[float]
    places: Sequence[float]
    speed_step: float
    unmoved: int
    failures: Sequence[AlikeFailures]


def explored(group: Group, batches: Sequence[Batch]) -> Explored | None:
    """The cells of the search of a group; None for another agent, or without its columns."""
    first = batches[int(group.rows["batch"].iloc[0])].plan
    placed = group.rows[group.rows["grade"].notna() & group.rows["meets_m"].notna()]
    if group.agent not in searching(first) or placed.empty:
        return None
    step = kind_named(first.scenario.kind).v_max / SPEEDS
    known = placed[placed["tester_speed_mps"].notna()]
    keys = [
        known["from_side"].astype(str),
        known["tester_speed_mps"].map(lambda v: min(SPEEDS - 1, int(v / step + 1e-9)) * step),
        known["meets_m"].map(lambda at: bin_of(at, PLACE_BIN_M)),
    ]
    cells = [_cell(key, rows) for key, rows in known.groupby(keys, sort=True)]
    return Explored(
        *group.whose,
        cells=cells,
        sides=[side for side in SIDES if any(cell.side == side for cell in cells)],
        speeds=[i * step for i in range(SPEEDS)],
        places=_steps([cell.place for cell in cells], PLACE_BIN_M),
        speed_step=step,
        unmoved=len(placed) - len(known),
        failures=_alike(placed[placed["outcome"] == "violated"]),
    )


def _cell(key: Any, rows: pandas.DataFrame) -> ExploredCell:
    """The cell of some rows with a key of side, speed and place."""
    side, speed, place = key
    best = int(rows["grade"].idxmax())
    grade = float(rows["grade"].loc[best])
    band = next(name for least, name in BANDS if grade >= least)
    return ExploredCell(side, speed, place, len(rows), grade, band, best)


def _alike(failures: pandas.DataFrame) -> list[AlikeFailures]:
    """Failures in groups that are alike."""
    kinds_of = [kind_of(row) for row in failures[list(FEATURES)].to_dict("records")]
    members: dict[tuple[float, str, float], list[int]] = {}
    for index, kind in zip(failures.index, kinds_of, strict=True):
        members.setdefault(kind, []).append(index)
    found = []
    for impact, side, place in sorted(members):
        rows = failures.loc[members[impact, side, place]]
        speeds = rows["tester_speed_mps"].dropna()
        kinds = [failure_kind({"outcome": "violated", "avoidable": a}) for a in rows["avoidable"]]
        alike = AlikeFailures(
            side,
            impact,
            place,
            slowest=float(speeds.min()) if len(speeds) else None,
            fastest=float(speeds.max()) if len(speeds) else None,
            count=len(rows),
            preventable=kinds.count(PREVENTABLE),
            indices=[int(i) for i in rows["grade"].sort_values(ascending=False).index],
        )
        found.append(alike)
    return sorted(found, key=lambda one: (-one.preventable, -one.count, one.place, one.side))


def _steps(values: Sequence[float], width: float) -> list[float]:
    """All bins from the least value to the largest."""
    if not values:
        return []
    low, high = min(values), max(values)
    return [low + i * width for i in range(round((high - low) / width) + 1)]
