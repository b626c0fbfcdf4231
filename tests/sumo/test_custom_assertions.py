"""Assertions of the user's: functions, classes and formulas, from the command line to the row."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from support import ROOT, rows, traces

from cavsumo.assertions import Assertion, make_assertions
from cavsumo.cli import main
from cavsumo.egos.base import EGO_KIND
from cavsumo.errors import AssertionFault, InputError, UnknownName
from cavsumo.model.bodies import CAR, Body
from cavsumo.model.polyline import Path as Polyline
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.testing import AssertionContract
from cavsumo.testing.assertion_checks import encounter
from cavsumo.testing.scripts import ground

NET = ROOT / "networks" / "pedestrians.net.xml"
Writer = Callable[..., str]

SOURCE = '''
from dataclasses import replace

from cavsumo.assertions.base import HELD, VIOLATED, Assertion, Judgement


def slow(snapshot, limit=9.0):
    """The ego keeps below a limit."""
    return limit - snapshot.ego.v

slow.PARAMETERS = {"limit": "the limit [m/s]"}
slow.sees_background = False


def near_the_end(snapshot, scene):
    """Once the ego is half way it is slower than 5 m/s."""
    if scene.ego_progress(snapshot) < scene.ego_path.length / 2:
        return None
    return 5.0 - snapshot.ego.v


class Jerk:
    """The ego changes its speed gently."""

    def __init__(self, most=20.0):
        self.most = most

    def reset(self, scene):
        self.dt, self.before = scene.dt, None

    def observe(self, snapshot):
        before, self.before = self.before, snapshot.ego.v
        return None if before is None else self.most - abs(snapshot.ego.v - before) / self.dt


class Whole(Assertion):
    """An assertion as cavsumo's own are written."""

    name = "whole"

    def reset(self, scene):
        super().reset(scene)
        self.judgement = Judgement(self.name, HELD, trigger_time=0.0)

    def observe(self, snapshot, contacts):
        if snapshot.ego.v > 11.0:
            self.judgement = replace(
                self.judgement, verdict=VIOLATED, violation_time=snapshot.time
            )
            self.decided = True

'''

FORMULAS = {
    "apart": "always (gap_m > 0.5)",
    "stops": "(gap_m < 3) => eventually[0,2] (speed_mps < 0.1)",
    "slows": "eventually (speed_mps < 0.5) or historically gap_m > 3",
    "alert": "gap_all_m < 5 => F[0,1] acceleration_mps2 < 0 since[0,3] ttc_all_s > 1",
}


@pytest.mark.parametrize("name", ["mine:slow", "mine:near_the_end", "mine:Jerk", "mine:Whole"])
class TestCustom(AssertionContract):
    """Functions and classes of the user's."""

    net = NET

    @pytest.fixture(autouse=True)
    def _named(self, name: str, controller: Writer) -> None:
        self.name = name
        controller(SOURCE, "mine")

    def make(self) -> Assertion:
        return make_assertions([self.name], {}, {}, 0.1)[0]


@pytest.mark.parametrize("name", FORMULAS)
class TestFormulas(AssertionContract):
    """Formulas of all sorts."""

    net = NET

    @pytest.fixture(autouse=True)
    def _named(self, name: str) -> None:
        self.name = name

    def make(self) -> Assertion:
        return make_assertions([self.name], {}, FORMULAS, 0.1)[0]


def watched(name: str, speeds: list[float], **params: float) -> Assertion:
    """An assertion after an episode with these speeds of the ego, 1 s apart."""
    (assertion,) = make_assertions([name], params, {}, 1.0)
    ego = Body("ego", CAR)
    assertion.reset(Scene(1.0, ego, Polyline([(0, 0), (100, 0)]), (), ()))
    for step, v in enumerate(speeds):
        state = BodyState(ego, 20.0 * step, 0.0, v, 0.0)
        assertion.observe(Snapshot(step, float(step), state, 0.0, ()), ())
    assertion.conclude()
    return assertion


def test_a_function_below_zero_is_a_violation(controller: Writer) -> None:
    """The first number below zero decides; the least so far is the robustness."""
    controller(SOURCE, "mine")
    held = watched("mine:slow", [8.0, 8.5, 7.0]).judgement
    assert (held.verdict, held.trigger_time, held.robustness) == ("held", 0.0, 0.5)
    broken = watched("mine:slow", [8.0, 8.5, 7.0, 9.0], limit=8.0).judgement
    assert (broken.verdict, broken.violation_time, broken.robustness) == ("violated", 1.0, -0.5)
    assert broken.assertion == "mine:slow"
    assert broken.ego_speed == 8.5


def test_none_is_a_precondition_that_does_not_hold(controller: Writer) -> None:
    """It triggers when a number comes first."""
    controller(SOURCE, "mine")
    said = watched("mine:near_the_end", [9.0] * 2).judgement
    assert (said.verdict, said.trigger_time, said.robustness) == ("not_triggered", None, None)
    said = watched("mine:near_the_end", [9.0, 9.0, 9.0, 4.0, 3.0]).judgement
    assert (said.verdict, said.trigger_time, said.robustness) == ("held", 3.0, 1.0)


def test_background_is_looked_at_unless_said_otherwise(controller: Writer) -> None:
    """A function that says nothing may look at everybody."""
    controller(SOURCE, "mine")
    names = ["mine:slow", "mine:near_the_end", "mine:Jerk"]
    made = make_assertions(names, {}, {}, 0.1)
    assert [a.sees_background for a in made] == [False, True, True]
    assert [a.sees_background for a in make_assertions(FORMULAS, {}, FORMULAS, 0.1)] == [
        False,
        False,
        False,
        True,
    ]


def test_parameters_go_to_whom_they_are_meant(controller: Writer) -> None:
    """To all that have them, or to one by its name; one that nobody has is refused."""
    controller(SOURCE, "mine")
    names = ["mine:slow", "mine:Jerk", "reaction-zone"]
    make_assertions(names, {"limit": 5.0, "mine:Jerk.most": 3.0, "clear_s": 2.0}, {}, 0.1)
    with pytest.raises(UnknownName, match="'limt'; did you mean 'limit'"):
        make_assertions(names, {"limt": 5.0}, {}, 0.1)


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("def f(s): return 1 / 0", r"f at 1\.00 s: raised ZeroDivisionError"),
        ("def f(s): return s.ego.v > 0", r"f at 1\.00 s: expected a number, .* got True"),
        ("def f(s): return float('nan')", r"f at 1\.00 s: expected a number, .* got nan"),
        ("def f(s): return 'low'", r"f at 1\.00 s: expected a number, .* got 'low'"),
        (
            "class f:\n def reset(self, scene): raise ValueError('a\\nb')\n"
            " def observe(self, s): return 1",
            "f: reset raised ValueError: a b",
        ),
        (
            "from cavsumo.assertions import Assertion\n"
            "class f(Assertion):\n name = 'f'\n"
            " def observe(self, s, c): self.judgement = 3",
            r"f at 1\.00 s: expected a Judgement with a verdict, got 3",
        ),
        (
            "from cavsumo.assertions import Assertion\n"
            "class f(Assertion):\n def observe(self, s, c): pass\n"
            " def conclude(self): raise KeyError('x')",
            "f at the end: raised KeyError",
        ),
    ],
)
def test_what_an_assertion_does_wrong_is_said_with_the_time(
    source: str, said: str, controller: Writer
) -> None:
    """One sentence, an error of the episode."""
    name = controller(source)
    (assertion,) = make_assertions([f"{name}:f"], {}, {}, 0.1)
    scene, frames = encounter(ground(NET, EGO_KIND), 1)
    snapshot = frames[10][0]

    def play() -> None:
        assertion.reset(scene)
        assertion.observe(snapshot, [])
        assertion.conclude()

    with pytest.raises(AssertionFault, match=f"assertion {name}:{said}") as caught:
        play()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("source", "name", "said"),
    [
        (
            "def slow(s): return 1",
            "m:slwo",
            "unknown function or class in module m 'slwo'; did you",
        ),
        ("x = 1", "m:x", "unknown function or class in module m 'x'"),
        ("import nowhere", "m:f", "no module named 'nowhere'"),
        (
            "def f(s, need): return 1",
            "m:f",
            "cannot be called: missing a required argument",
        ),
        ("class f:\n pass", "m:f", "has no method observe"),
        ("class f:\n def __init__(self): 1 / 0", "m:f", "cannot be built: ZeroDivisionError"),
        ("", "gap_m > 1", "a formula is asserted by its name: --formula NAME='...'"),
    ],
)
def test_what_is_no_assertion_is_refused(
    source: str, name: str, said: str, controller: Writer
) -> None:
    """Before anything runs, in one sentence."""
    controller(source, "m")
    with pytest.raises(InputError, match=said):
        make_assertions([name], {}, {}, 0.1)


def test_a_formula_has_a_name_of_its_own() -> None:
    """Not that of an assertion, and no odd letters."""
    with pytest.raises(InputError, match="formula collision: an assertion has that name already"):
        make_assertions([], {}, {"collision": "true"}, 0.1)
    with pytest.raises(InputError, match="formula 'a b': a name has letters"):
        make_assertions([], {}, {"a b": "true"}, 0.1)


# In SUMO ------------------------------------------------------------------------------------------


@pytest.fixture
def street(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, controller: Writer) -> Path:
    """The working folder, with a network and a module."""
    shutil.copy(NET, tmp_path / "street.net.xml")
    monkeypatch.chdir(tmp_path)
    controller(SOURCE, "mine")
    return tmp_path


def run(file: str, *words: str) -> int:
    """A batch of two short episodes on an empty street."""
    common = "run -n street.net.xml -r none --runs 2 -e 6 --trace all -q -o".split()
    return main([*common, file, *words])


def test_a_scenario_file_with_formulas(street: Path) -> None:
    """One held and one violated: rows, replay and the number of processes agree."""
    (street / "own.toml").write_text(
        'ego = "constant"\n[formulas]\nmoving = "always[1,5] (speed_mps > 0.1)"\n'
        'calm = "time_s > 2 => next (speed_mps < 1)"\n',
        encoding="utf-8",
    )
    assert run("both.csv", "-c", "own.toml") == 1
    assert run("held.csv", "-c", "own.toml", "--assert", "moving") == 0
    assert run("pair.csv", "-c", "own.toml", "-j", "2") == 1
    alone, together = (rows(street / name) for name in ("both.csv", "pair.csv"))
    assert [row | {"trace": ""} for row in together] == [row | {"trace": ""} for row in alone]
    assert traces(street / "pair.csv") == traces(street / "both.csv")
    for row in rows(street / "both.csv"):
        assert (row["outcome"], row["assertion"]) == ("violated", "calm")
        assert (row["trigger_time_s"], row["violation_time_s"]) == ("2.100", "2.200")
    for row in rows(street / "held.csv"):
        assert (row["outcome"], row["assertion"]) == ("held", "moving")
    assert main(["replay", "both.csv", "1"]) == 0
    plan: Mapping[str, Any] = json.loads((street / "both.json").read_text(encoding="utf-8"))["plan"]
    assert plan["scenario"]["assertions"] == ["moving", "calm"]


def test_a_function_on_the_command_line(street: Path) -> None:
    """Its row has its name, its file stands in the manifest, its replay is the same."""
    words = ["--assert", "mine:slow", "--assert-param", "limit=5", "--ego", "constant"]
    assert run("own.csv", *words) == 1
    assert {row["assertion"] for row in rows(street / "own.csv")} == {"mine:slow"}
    found = json.loads((street / "own.json").read_text(encoding="utf-8"))["sha256"]
    expected = hashlib.sha256((street / "mine.py").read_bytes()).hexdigest()
    assert found["mine.py"] == expected
    assert main(["replay", "own.csv", "0", "--trust"]) == 0


def test_a_formula_on_the_command_line_is_asserted_beside_others(street: Path) -> None:
    """Nobody writes one there to leave it out."""
    assert run("both.csv", "--formula", "apart=always (gap_m > -9)", "--assert", "collision") in (
        0,
        1,
    )
    for row in rows(street / "both.csv"):
        assert [said.split("=")[0] for said in row["verdicts"].split()] == ["collision", "apart"]


def test_a_fault_is_an_error_row(street: Path, controller: Writer) -> None:
    """An assertion that raises costs its episode, exit status 3."""
    controller("def late(s):\n    return 1 / abs(s.step - 3)\n", "faulty")
    assert run("fault.csv", "--assert", "faulty:late") == 3
    said = "assertion faulty:late at 0.30 s: raised ZeroDivisionError: division by zero"
    assert {(r["outcome"], r["error"]) for r in rows(street / "fault.csv")} == {("error", said)}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--formula", "a=always (gapm > 1)"], "formula a: column 9: unknown signal 'gapm'"),
        (["--formula", "always"], "--formula: expected NAME=TEXT, got 'always'"),
        (["--formula", "a=F[0,0.01] light > 0 and"], "formula a: column 24: expected a signal"),
        (["--formula", "a=true", "--assert", "b"], "unknown assertion 'b'"),
        (["--assert", "mine:slwo"], "did you mean 'slow'?"),
    ],
)
def test_mistakes_write_nothing(
    street: Path, words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit status 2, one sentence."""
    before = set(street.iterdir())
    assert run("bad.csv", *words) == 2
    assert said in capsys.readouterr().err
    assert set(street.iterdir()) - before <= {street / "__pycache__"}  # by the import of mine.py


def test_listings(street: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Both forms are mentioned, and a user's function shows its parameters."""
    assert main(["assertions"]) == 0
    assert main(["assertions", "mine:slow"]) == 0
    shown = capsys.readouterr().out
    for words in ("module:function", "NAME=FORMULA", "limit=9.0", "the limit [m/s]"):
        assert words in shown
