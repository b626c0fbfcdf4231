"""Columns: one list makes the row, the header, the manifest's explanations and the docs' table."""

from __future__ import annotations

import pytest
from support import ROOT

from cavsumo.assertions.base import Judgement
from cavsumo.batch.jobs import Job, finished
from cavsumo.batch.replay import first_difference
from cavsumo.model.scenario import BatchPlan, plan_from
from cavsumo.results.columns import COLUMNS, markdown_table, measured, row_of
from cavsumo.results.rows import cell
from cavsumo.simulation.episode import Episode

UNITS = {"s": "s", "m": "m", "mps": "m/s", "mps2": "m/s²", "rad": "rad"}


@pytest.fixture
def plan() -> BatchPlan:
    """A plan of one episode."""
    return plan_from({"net": "crossing", "agents": ["noop"], "runs": 1}, "test")


def test_the_table_of_the_docs_is_that_of_the_list() -> None:
    """Made anew by ``columns.markdown_table`` when a column is added."""
    text = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")
    shown = text.partition("<!-- columns -->\n")[2].partition("<!-- end -->")[0]
    assert shown == markdown_table()


def test_a_name_ends_with_its_unit() -> None:
    """So that whoever reads the header alone knows it."""
    for name, column in COLUMNS.items():
        end = name.rpartition("_")[2]
        if end in UNITS:
            assert column.unit == UNITS[end], name
        elif column.unit:
            assert name == "cost"  # named before there were units


def test_a_row_of_an_episode_that_could_not_be_played(plan: BatchPlan) -> None:
    """What is known beforehand, and why; nothing else is filled."""
    row = row_of(finished(plan, Job(3, "noop", 17), error="SUMO is gone"))
    assert list(row) == list(COLUMNS)
    filled = {name: value for name, value in row.items() if value is not None}
    scenario = plan.scenario
    assert filled == {
        "run": 3,
        "agent": "noop",
        "ego": scenario.ego,
        "testers": scenario.testers,
        "reset": "fresh",
        "embodiment": scenario.embodiment,
        "sumo_width_m": scenario.sumo_width,
        "seed": 17,
        "outcome": "error",
        "error": "SUMO is gone",
    }


def test_what_an_episode_fills_is_the_same_in_a_row(plan: BatchPlan) -> None:
    """The environments' summary takes its values from the same entries."""
    episode = Episode(Judgement("reaction-zone"), {"reaction-zone": "not_triggered"}, steps=4)
    row = row_of(finished(plan, Job(0, "noop", 17), episode))
    figures = measured(episode)
    assert figures == {name: row[name] for name in figures}
    assert {"run", "agent", "avoidable", "error", "wall_s"} & set(figures) == set()
    assert (figures["outcome"], figures["steps"]) == ("not_triggered", 4)


def test_a_record_from_before_a_column_is_the_same(plan: BatchPlan) -> None:
    """A trace of an older version says nothing of it; what it does say must agree."""
    again = row_of(finished(plan, Job(3, "noop", 17), Episode(Judgement("reaction-zone"))))
    record = {name: cell(value) for name, value in again.items() if name != "frozen"}
    assert first_difference(record, None, again, ()) is None
    found = first_difference(record | {"steps": "7"}, None, again, ())
    assert found is not None
    assert found.quantity == "steps"
