"""The results of a suite: the line of each test, and the page with the grids."""

from __future__ import annotations

from typing import Any

import pytest

from cavsumo.report.pages.suite.page import suite_page
from cavsumo.report.suite_results import (
    SuiteTold,
    case_results,
    result_of,
    suite_table,
)

TOLD = SuiteTold("A suite", "by us", "time-gap", "results.csv", {"NEAR": "near side", "FAR": ""})


def row(run: int, case: str, outcome: str, mps: float = 0.0, layer: int = 0) -> dict[str, Any]:
    """A row of results, as text where it matters."""
    speed = case.split("/")[1]
    return {
        "run": str(run),
        "case": case,
        "parameters": f"test={case.split('/')[0]} ego_kmh={speed} variation={layer}",
        "outcome": outcome,
        "ego_speed_mps": str(mps) if outcome == "violated" else "",
        "error": "the ego is gone" if outcome == "error" else "",
        "breach": "",
    }


ROWS = [
    row(0, "NEAR/20/50", "held"),
    row(1, "NEAR/40/50", "violated", 10.0 / 3.6),
    row(2, "NEAR/40/75", "violated", 30.0 / 3.6),
    row(3, "FAR/60/50", "error"),
    row(4, "NEAR/20/50", "violated", 20.0 / 3.6, layer=1),
    {"run": "5", "case": "", "parameters": "", "outcome": "held"},
]
CASES = case_results(ROWS)


def test_a_case_is_avoided_or_has_an_impact_in_a_band() -> None:
    """A row of no suite is left out; one that could not be played is not judged."""
    assert [case.band for case in CASES] == [
        *("avoided", "up to a quarter", "to three quarters", "not judged", "above three quarters"),
    ]
    assert CASES[1].impact == pytest.approx(10.0)
    assert CASES[1].share == pytest.approx(0.25)
    assert CASES[3].why == "the ego is gone"


def test_a_test_has_shares_and_means_of_its_judged_cases() -> None:
    """The mean of the shares counts an avoided case as nothing."""
    near = result_of("NEAR", [case for case in CASES if case.test == "NEAR"])
    assert (near.cases, near.avoided, near.not_judged) == (4, 1, 0)
    assert near.mean_impact == pytest.approx(20.0)
    assert near.worst_impact == pytest.approx(30.0)
    assert near.mean_share == pytest.approx((0.0 + 0.25 + 0.75 + 1.0) / 4)


def test_the_table_has_a_line_for_each_test_and_one_for_all() -> None:
    """Those not judged are counted apart, where there are any."""
    head, *lines = suite_table(CASES).splitlines()
    assert head.split()[-2:] == ["not", "judged"]
    assert [line.split()[:3] for line in lines] == [
        ["NEAR", "4", "1"],
        ["FAR", "0", "0"],
        ["all", "4", "1"],
    ]
    assert "not judged" not in suite_table(CASES[:2])


def test_a_suite_may_know_what_is_preventable_and_what_is_allowed() -> None:
    """Each has a column of its own."""
    told = [dict(one, parameters=f"{one['parameters']} preventable=1.0") for one in ROWS[:2]]
    head, line = suite_table(case_results(told)).splitlines()
    assert (head.split()[-1], line.split()[-1]) == ("preventable", "1")
    limits = [dict(one, parameters=f"{one['parameters']} allowed_kmh=10") for one in ROWS[:3]]
    head, line = suite_table(case_results(limits)).splitlines()
    assert (head.split()[-2:], line.split()[-1]) == (["within", "limit"], "2")


def test_the_page_has_a_grid_for_each_test_in_the_order_of_the_suite() -> None:
    """Rows are speeds, columns the rest of the names; the worst variation colours a cell."""
    page = suite_page(TOLD, CASES)
    assert page.index("NEAR: near side") < page.index("FAR:")
    assert '<td class="band1" title="NEAR/40/50: up to a quarter, 25%' in page
    assert '<td class="band4" title="NEAR/20/50: above three quarters' in page
    assert ">1 of 2, 20 km/h</td>" in page
    assert "the ego is gone" in page
    assert "No official score" in page


def test_cases_with_a_number_alone_stand_in_lines_of_twenty() -> None:
    """Such as draws; the corner of a grid names the parameter of its rows."""
    rows = [dict(row(i, f"START/{i + 1}", "held")) for i in range(41)]
    told = SuiteTold("", "", "sumo", "a.csv", {"START": ""}, {"START": ("draw",)})
    page = suite_page(told, case_results(rows))
    assert '<th scope="col">draw</th><th scope="col">+0</th>' in page
    assert page.count('<th scope="row">') == 1 + 3
    assert page.index('<th scope="row">21</th>') < page.index("START/21:")
