"""What a search has explored, from its rows: cells with their best grade, and alike failures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from report_files import FAILED, HELD, NOTHING, UNFAIR, write

from cavsumo.report.analysis import analyse
from cavsumo.report.explored import AlikeFailures, ExploredCell
from cavsumo.results.alike import kind_of
from cavsumo.results.failures import graded
from cavsumo.results.reading import rows_of


def _test(outcome: str, grade: float, side: str, speed: float | None, place: float) -> Any:
    """The cells of an episode of a search."""
    course = {"from_side": side, "tester_speed_mps": speed, "meets_m": place}
    judged = {"avoidable": int(grade >= 0.0), "reference": "human"} if outcome == FAILED else {}
    return [{"outcome": outcome, "grade": grade, **course, **judged}]


PLAYED = [
    _test(NOTHING, -3.2, "left", 0.4, 21.0),
    _test(UNFAIR, -2.4, "left", 0.6, 29.9),
    _test(HELD, -1.2, "left", 0.6, 41.0),
    _test(FAILED, -0.5, "right", 1.4, 41.0),
    _test(FAILED, 3.0, "right", 1.2, 45.0),
    _test(NOTHING, -3.9, "left", None, 41.0),
]


def test_a_cell_has_its_best_grade(tmp_path: Path) -> None:
    """Pedestrians up to 1.4 m/s in four bins; who never moved on the road is in no cell."""
    (found,) = analyse([write(tmp_path / "a.csv", PLAYED, agents=["search"])]).explored
    assert found.cells == [
        ExploredCell("left", pytest.approx(0.35), 20.0, 2, -2.4, "unfair", 1),
        ExploredCell("left", pytest.approx(0.35), 40.0, 1, -1.2, "held", 2),
        ExploredCell("right", pytest.approx(1.05), 40.0, 2, 3.0, "preventable", 4),
    ]
    assert (found.sides, found.places, found.unmoved) == (["left", "right"], [20.0, 30.0, 40.0], 1)
    assert found.speeds == pytest.approx([0.0, 0.35, 0.7, 1.05])
    assert found.failures == [AlikeFailures("right", 2.0, 40.0, 1.2, 1.4, 2, 1, [4, 3])]


def test_only_searches_are_mapped(tmp_path: Path) -> None:
    """And results that have no places have no map."""
    assert analyse([write(tmp_path / "b.csv", PLAYED, agents=["timing"])]).explored == []
    assert analyse([write(tmp_path / "c.csv", [[HELD]], agents=["search"])]).explored == []


def test_the_report_counts_failures_as_a_search_does(tmp_path: Path) -> None:
    """Its table of cells, its figures, the groups on its page: by the rows, without traces."""
    more = [_test(FAILED, 0.5, "left", 1.0, 12.0), _test(FAILED, 0.7, "right", 1.0, 49.0)]
    file = write(tmp_path / "a.csv", [*PLAYED, *more], agents=["search"])
    report = analyse([file])
    kinds = {kind_of(row) for row in rows_of(file) if row["outcome"] == FAILED}
    preventable = {kind_of(row) for row in rows_of(file) if graded(row)[1]}
    (found,), (counted,) = report.explored, report.distinct
    assert len(kinds) == 2
    assert {(one.impact, one.side, one.place) for one in found.failures} == kinds
    cells = {(one.cell.speed, one.cell.side, one.cell.place) for one in report.failures}
    assert cells == kinds
    assert (counted.failures.known, counted.failures.cells) == (4, len(kinds))
    assert counted.preventable.cells == len(preventable)
    assert sum(one.preventable > 0 for one in found.failures) == len(preventable)
