"""Scripts of benchmarks/ about drivers and published tests, at their smallest size."""

from __future__ import annotations

import re
import sys

import pytest
from scripts_played import Play, numbers
from support import ROOT, benchmark

from cavsumo.assertions import criticality_monitor

pytestmark = pytest.mark.usefixtures("inline")
NET = str(ROOT / "networks" / "pedestrians.net.xml")


def test_reference_tracks(play: Play) -> None:
    """One cell: the largest differences are within the tolerances."""
    test, everything = play("reference_tracks", "--only", "CPFA/60/50").splitlines()[1:]
    assert (test.split()[:2], everything.split()[0]) == (["CPFA", "1"], "all")
    place, speed, impact = numbers(everything)[1:]
    assert place < 0.05
    assert speed < 0.05
    assert impact < 0.02


def test_un_r157(play: Play) -> None:
    """The grid of decelerations, without a collision, as published."""
    (line,) = play("un_r157", "--test", "deceleration").splitlines()[1:]
    assert line.split() == ["deceleration", "1,121", "0", "0"]


def test_suite_drivers(play: Play) -> None:
    """Two drivers through one case."""
    words = ["--ego", "constant", "--ego", "sumo:IDM/0", "--only", "CPNA/30/50", "-j", "1"]
    _, first, second, _ = play("suite_drivers", *words).splitlines()
    assert first.split()[:4] == ["constant", "0", "of", "1"]
    assert second.split()[:4] == ["sumo:IDM/0", "1", "of", "1"]


def test_drivers_table(play: Play) -> None:
    """One driver, one case of each suite, one episode on one network."""
    words = [NET, "--ego", "constant", "--ncap", "372", "--r157", "36941", "--runs", "1"]
    _, _, line, _, head, _, by_test = play("drivers_table", *words, "--traffic", "0").splitlines()
    assert line.startswith("| constant | 0 of 1 [0, 79 %] | 10.0 | ")
    assert (head, by_test) == ("| ego | CPNA |", "| constant | 0/1, 10 |")


def test_drivers(play: Play) -> None:
    """Two egos that are built in, and a program in the place of a planner."""
    words = "--runs 1 --traffic 0 --agent timing --ego time-gap --ego sumo:IDM/0 --planner"
    program = {"careful": "../egos/stop_for_pedestrians.py"}
    said = play("drivers", NET, *words.split(), f"careful={sys.executable}", SCRIPTS=program)
    lines = [line.split() for line in said.splitlines()[1:]]
    assert [(line[0], line[-1]) for line in lines] == [
        ("time-gap", "0"),
        ("sumo:IDM/0", "0"),
        ("careful", "0"),
    ]


def test_cav_gym(play: Play) -> None:
    """One episode a cell, and two of the timing tester."""
    said = play("cav_gym", "--runs", "1", "--timing-runs", "2")
    assert len(re.findall(r"^\S+ +[136] .*(?:yes|NO)$", said, re.MULTILINE)) == 12


def test_ssm(play: Play) -> None:
    """It has no size: all encounters."""
    assert len(play("ssm").splitlines()) > 3


def test_criticality(play: Play, monkeypatch: pytest.MonkeyPatch) -> None:
    """An episode of each network."""
    for names in benchmark("criticality").PARTS.values():
        for name in names:  # so that it is put back afterwards
            monkeypatch.setattr(criticality_monitor, name, getattr(criticality_monitor, name))
    said = play("criticality", "--episodes", "1")
    assert [line.split()[0] for line in said.splitlines()[1:]] == [
        "crossing",
        "junction",
        "pedestrians",
    ]
    assert said.count("%") == 6
