"""Suites: expressions, cells, filters, and the scripts that are made of them."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import pytest

from cavsumo.errors import InputError, UnknownName
from cavsumo.model.scenario import BatchPlan, Scenario, plan_from
from cavsumo.model.scenario.suite import SuiteChoice
from cavsumo.model.scenario_file import read_config
from cavsumo.suites.cases import SuiteCases, case_plan
from cavsumo.suites.cells import all_cells, selected_cells
from cavsumo.suites.expressions import evaluated
from cavsumo.suites.files import read_suite, suite_file, suite_names
from cavsumo.suites.parts import suite_part
from cavsumo.suites.street_walks import CAV_GYM, walks

NAME = "euroncap-2026"
SUITE = read_suite(suite_file(NAME))

MINE = """
title = "Mine"
[values]
v_kmh = 30
[ego]
speed_mps = "kmh(ego_kmh)"
start_m = -40
way = { y_m = -1.75 }
[bodies.box]
kind = "pedestrian"
length_m = 0.5
width_m = 0.5
[[tests]]
name = "STAND"
net = "proving-road"
ego_route = ["eastbound"]
case = ["ego_kmh"]
cells = [{ ego_kmh = [20, 30] }]
[[tests.testers]]
body = "box"
way = { x_m = "box_length / 2", y_m = -1.75 }
"""


def plan(choice: SuiteChoice) -> BatchPlan:
    """The plan of a choice."""
    part = suite_part(choice.name, choice.model_dump(exclude={"name"}), {"ego": "constant"})
    return plan_from(part.settings, "test")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1 + 2 * 3 - 4 / 2 ** 2", 6.0),
        ("-(a + 1) * kmh(36)", -30.0),
        ("deg(180) - pi", 0.0),
        ("max(a, 5) + abs(-1) + sqrt(4)", 8.0),
        ("word", "noon"),
    ],
)
def test_an_expression_has_the_value_of_its_arithmetic(text: str, value: float | str) -> None:
    """With names, brackets and the functions."""
    found = evaluated(text, {"a": 2, "pi": math.pi, "word": "noon"})
    assert found == (value if isinstance(value, str) else pytest.approx(value))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "1 +",
        "1 / 0",
        "__import__('os')",
        "a.b",
        "[1]",
        "'x'",
        "2 ** 99",
        "acos(2)",
        "a if 1 else 2",
    ],
)
def test_anything_else_is_refused_in_plain_words(text: str) -> None:
    """Nothing but arithmetic is computed."""
    with pytest.raises((ValueError, UnknownName)):
        evaluated(text, {"a": 1})


def test_an_unknown_name_is_refused_with_the_nearest() -> None:
    """As any name."""
    with pytest.raises(UnknownName, match="'ego_width'"):
        evaluated("ego_widht / 2", {"ego_width": 1.8})


def test_the_standard_range_and_the_extended_one_have_the_cells_of_the_protocol() -> None:
    """77 and 135 cells of tests with pedestrians and bicyclists, by daylight."""
    vulnerable = {"CPNA", "CPFA", "CPNCO", "CPLA", "CBNA", "CBNAO", "CBFA", "CBLA"}
    cells = [cell for cell in all_cells(SUITE) if cell.test.name in vulnerable]
    assert sum(not cell.extended for cell in cells) == 77
    assert sum(cell.extended for cell in cells) == 135
    names = [cell.name for cell in all_cells(SUITE)]
    assert len(set(names)) == len(names)


def test_every_cell_of_every_suite_becomes_a_scenario() -> None:
    """No expression lacks a name, no script is refused, variations included.

    Of suites with many draws of a cell, or steps of a value, some of each.
    """
    for name in suite_names():
        suite = read_suite(suite_file(name))
        choice = SuiteChoice(name=name, extended=True, vary=1)
        cases = SuiteCases(suite, choice, suite_file(name).parent, 1)
        base = Scenario(net=Path("crossing"))
        for run in range(0, len(cases), 1 if len(cases) < 2000 else len(cases) // 250):
            assert cases.scenario(run, base).script is not None


def test_filters_select_tests_cases_and_speeds() -> None:
    """In the order of the file; a case that is named whole is played in any range."""

    def names(**given: object) -> list[str]:
        chosen = SuiteChoice.model_validate({"name": NAME, **given})
        return [cell.name for cell in selected_cells(SUITE, chosen)]

    assert names(only=["CPFA"], speeds=[30, 40]) == ["CPFA/30/50", "CPFA/40/50"]
    assert names(only=["CPNA/30/*"]) == ["CPNA/30/25", "CPNA/30/50", "CPNA/30/75"]
    assert names(only=["CPNA/30/10"]) == ["CPNA/30/10"]
    assert len(names(only=["CPFA"], extended=True)) == 30


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"only": ["CPNB"]}, "unknown test 'CPNB'; nearest: 'CPNA'|unknown test 'CPNB'"),
        ({"only": ["CPNA/30/51"]}, "unknown case 'CPNA/30/51'"),
        ({"speeds": [31]}, "no case at ego_kmh 31"),
        ({"only": ["CBLA"], "speeds": [10]}, "no case is left by the filters"),
    ],
)
def test_a_filter_that_leaves_nothing_is_refused(given: dict[str, object], said: str) -> None:
    """In one sentence, with the nearest name."""
    with pytest.raises(InputError, match=said):
        suite_part(NAME, given, {})


def test_values_and_sizes_can_be_set() -> None:
    """The boxes of all bodies are parameters, and impact points move with them."""
    values = (("ego_width", 2.0), ("adult_length", 0.5))
    one = case_plan(plan(SuiteChoice(name=NAME, only=("CPNA/40/75",), values=values)), 0)
    script = one.scenario.script
    assert script is not None
    assert (script.ego.width_m, script.testers[0].length_m) == (2.0, 0.5)
    assert script.testers[0].begins is not None
    assert script.testers[0].begins.own_at_m == pytest.approx(4 + 0.5 + 0.36 - 0.25)
    with pytest.raises(UnknownName, match="ego_width"):
        suite_part(NAME, {"values": (("ego_widht", 2.0),)}, {})


def test_an_unknown_suite_is_refused_with_the_nearest() -> None:
    """As any name."""
    with pytest.raises(UnknownName, match="euroncap-2026"):
        suite_part("euroncap-2025", {}, {})


def test_a_run_of_a_suite_is_a_plan_by_itself() -> None:
    """With the script of its case, and the user's settings."""
    whole = plan(SuiteChoice(name=NAME, only=("CPNA/40/50",)))
    one = case_plan(whole, 0)
    assert (one.suite, one.scenario.ego, one.agents) == (None, "constant", ("scripted",))
    script = one.scenario.script
    assert script is not None
    assert (script.name, script.parameters["impact_percent"]) == ("CPNA/40/50", 50)
    assert script.ego.speed_mps == pytest.approx(40 / 3.6)
    assert BatchPlan.model_validate_json(one.model_dump_json()) == one


def test_variations_are_drawn_within_their_limits_and_do_not_depend_on_the_selection() -> None:
    """Layer 0 is the case as published; more layers add runs and change none."""
    few = plan(SuiteChoice(name=NAME, only=("CPNA/40/50",), vary=3))
    many = plan(SuiteChoice(name=NAME, only=("CPNA",), vary=5))
    cell = next(r for r in range(18) if _parameters(many, r)["impact_percent"] == 50)
    at_40 = next(r for r in range(cell, 18, 3) if _parameters(many, r)["ego_kmh"] == 40)
    for layer in range(4):
        drawn = _parameters(few, layer)
        assert drawn == _parameters(many, at_40 + 18 * layer)
        assert 3 <= float(drawn["target_kmh"]) <= 8
        assert -20 <= float(drawn["turn_deg"]) <= 20
        assert 3 <= float(drawn["start_m"]) <= 4
        assert (drawn["target_kmh"] == 5) == (layer == 0)


def _parameters(whole: BatchPlan, run: int) -> dict[str, object]:
    """The parameters of a run."""
    script = case_plan(whole, run).scenario.script
    assert script is not None
    return dict(script.parameters)


def test_the_documented_suite_and_script_are_read(tmp_path: Path) -> None:
    """As they stand in docs/suites.md."""
    text = (Path(__file__).parents[2] / "docs" / "suites.md").read_text(encoding="utf-8")
    suite, scenario = (part.split("```")[0] for part in text.split("```toml\n")[1:])
    file = tmp_path / "bus.toml"
    file.write_text(suite, encoding="utf-8")
    whole = plan(SuiteChoice(name=str(file), extended=True, vary=1))
    scripts = [case_plan(whole, run).scenario.script for run in range(whole.runs)]
    assert [script.name for script in scripts if script][:2] == ["BUS/30/6", "BUS/30/8"]
    assert len(scripts) == 2 * 12
    file.write_text(scenario, encoding="utf-8")
    one = plan_from(read_config(file), "test").scenario
    assert one.script is not None
    assert (one.script.name, one.testers) == ("", 1)


def test_a_suite_of_ones_own_is_read_from_its_file(tmp_path: Path) -> None:
    """Cases, names and boxes as in its text."""
    file = tmp_path / "mine.toml"
    file.write_text(MINE, encoding="utf-8")
    whole = plan(SuiteChoice(name=str(file)))
    scripts = [case_plan(whole, run).scenario.script for run in range(whole.runs)]
    assert [script.name for script in scripts if script] == ["STAND/20", "STAND/30"]
    assert scripts[0] is not None
    assert scripts[0].testers[0].way.x_m == 0.25


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('title = "Mine"', 'titel = "Mine"', "title: .*equired|titel"),
        ("speed_mps", "sped_mps", "ego.speed_mps: Field required|ego"),
        ("box_length", "box_lenght", "unknown name 'box_lenght'"),
        ('body = "box"', 'body = "bax"', "unknown body 'bax'"),
        ("-40", '"1 / 0"', "has no value"),
        ('case = ["ego_kmh"]', 'case = ["kmh"]', "unknown parameter 'kmh'"),
        ('net = "proving-road"', 'net = "proving-raod"', "proving-raod"),
    ],
)
def test_a_mistake_in_a_suite_is_one_sentence(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    """It names the file or the case, and what was expected."""
    file = tmp_path / "mine.toml"
    file.write_text(MINE.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match=said):
        case_plan(plan(SuiteChoice(name=str(file))), 0)


def test_walks_are_the_same_for_a_draw_and_cross_when_the_tester_says() -> None:
    """Of those near the ego; with election no two are on the road at once."""
    first, again = (walks(CAV_GYM, "proximity", 3, 1) for _ in range(2))
    assert first == again
    assert first != walks(CAV_GYM, "proximity", 3, 2)
    sides = [(points[0][1] > 0.0, points[-1][1] > 0.0) for points in first]
    assert any(begins != ends for begins, ends in sides)
    elected = walks(CAV_GYM, "election", 3, 1)
    on_road = [[abs(y) < CAV_GYM.kerb for _, y in points] for points in elected]
    assert all(sum(now) <= 1 for now in zip(*on_road, strict=True))
    steps = [math.dist(a, b) for points in first for a, b in pairwise(points)]
    assert max(steps) == pytest.approx(0.14)


def test_a_table_of_testers_may_stand_for_several(tmp_path: Path) -> None:
    """With their index in its expressions; a count that is no number of testers is refused."""
    file = tmp_path / "mine.toml"
    text = MINE.replace('body = "box"', 'body = "box"\ncount = 3')
    text = text.replace('/ 2", y_m = -1.75', '/ 2", y_m = "index"')
    file.write_text(text, encoding="utf-8")
    choice = SuiteChoice(name=str(file))
    script = case_plan(plan(choice), 0).scenario.script
    assert script is not None
    assert [tester.way.y_m for tester in script.testers] == [0.0, 1.0, 2.0]
    file.write_text(text.replace("count = 3", "count = 0.5"), encoding="utf-8")
    with pytest.raises(InputError, match=r"count: 0\.5 is no whole number from 1 to 100"):
        case_plan(plan(choice), 0)
