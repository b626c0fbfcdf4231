"""Scripts of benchmarks/ about searches and what becomes of failures, at their smallest size."""

from __future__ import annotations

import importlib.util
import re
import shutil
import sys

import pytest
from scripts_played import Play, numbers
from support import ROOT

pytestmark = pytest.mark.usefixtures("inline")
NET = str(ROOT / "networks" / "pedestrians.net.xml")


@pytest.mark.parametrize("agent", ["search", "exposure"])
def test_early_end(play: Play, agent: str) -> None:
    """The same is learned of every point, in less time."""
    words = "--net", NET, "--ego", "constant", "--runs", "30", "--agent", agent
    found = play("early_end", *words).splitlines()[1]
    runs, cut, differ, whole, shorter = numbers(found)[:5]
    assert (runs, differ) == (30, 0)
    assert cut > 0
    assert shorter < whole


def test_searches(play: Play) -> None:
    """A search and another agent, two seeds each."""
    words = "--ego", "constant", "--runs", "10", "--seed", "1", "2"
    _, _, *found = play("searches", NET, *words).splitlines()
    assert [row.split()[1] for row in found] == ["search:portfolio", "timing"]
    assert all(row.split()[2] in ("0/2", "1/2", "2/2") for row in found)


def test_searched_vehicles(play: Play) -> None:
    """A line for each tester; nobody reaches a conclusion in two episodes."""
    wanted = ["--tester", "search:random", "--tester", "timing", "--runs", "2", "--seed", "1"]
    crossing = str(ROOT / "networks" / "crossing.net.xml")
    lines = play("searched_vehicles", crossing, "--kind", "bicycle", *wanted).splitlines()[2:]
    cells = [line.split()[:5] for line in lines]
    names = [["crossing", "bicycle", tester] for tester in ("search:random", "timing")]
    assert [row[:3] for row in cells] == names
    assert all(row[3] in ("0/1", "1/1") for row in cells)


def test_aims(play: Play) -> None:
    """Two episodes of an aim, of which the first explores."""
    words = "--runs", "2", "--explore", "1", "--net", NET
    _, found = play("aims", *words, AIMS=("violation",)).splitlines()
    assert found.split()[:3] == ["pedestrians", "violation", "1"]


def test_street_suites(play: Play) -> None:
    """One draw of each tester and number of pedestrians in one suite."""
    lines = play("street_suites", "--suite", "chance-2019", "--draws", "1", "-j", "1").splitlines()
    assert len(lines) == 17
    assert lines[-1].split()[:3] == ["chance-2019", "election", "10"]


def test_places(play: Play) -> None:
    """One place, one ego, two agents of which one learns for an episode."""
    words = "--runs 1 --learn 1 --traffic 0 -j 1 --ego time-gap --agent timing"
    said = play("places", NET, *words.split(), "--agent", "best-response")
    lines = [line.split() for line in said.splitlines()[1:]]
    assert [line[:3] for line in lines] == [
        ["pedestrians", "time-gap", "timing"],
        ["pedestrians", "time-gap", "best-response"],
    ]
    assert {len(line) for line in lines} == {11}


def test_best_response(play: Play) -> None:
    """One episode each of learning, of timing and of what was learned."""
    said = play(
        "best_response", "--train", "1", "--runs", "1", "--jobs", "1",
        "--net", "pedestrians", "--ego", "constant",
    )  # fmt: skip
    assert [line.split()[2] for line in said.splitlines()[1:]] == ["timing", "best-response"]
    assert "could not be played" not in said


def test_forecasts(play: Play) -> None:
    """Two starts of each tester."""
    said = play("forecasts", "--runs", "2", "--timing-runs", "2")
    assert "right: 2 of 2" in said
    assert "tests in the first 2 starts" in said


def test_avoidable(play: Play) -> None:
    """One ego, one agent, both reference drivers."""
    said = play("avoidable", "--runs", "1", "-j", "1", EGOS=("constant",), AGENTS=("random",))
    assert [line.split()[:2] for line in said.splitlines()[1:]] == [
        ["constant", "random"],
        ["constant", "all"],
    ]


def test_minimise(play: Play) -> None:
    """A failure at the crossing, by force too, and with planted bodies."""
    said = play(
        "minimise", "--failures", "1", "--runs", "20", "--force", "1", "--planted", "1",
        "--net", "crossing", "--kind", "pedestrians", PLANTED=5,
    )  # fmt: skip
    _, one, everything, force, planted = said.splitlines()
    assert one.split()[2:7] == ["1", "1", "1", "1", "1"]
    assert everything.split()[1:] == one.split()[2:]
    assert re.fullmatch(r"by force: 0 of \d+ single reductions of 1 results fail the same", force)
    assert planted.startswith("planted: 5 bodies in ")


def test_exports(play: Play) -> None:
    """A failure, exported and imported again; read by commonroad-io and played, where they are."""
    words = ["--net", "crossing", "--failures", "1", "--runs", "3"]
    there = importlib.util.find_spec("commonroad") is not None
    words += ["--commonroad", sys.executable] if there else []
    _, one, everything = play("exports", *words, KINDS=("pedestrian",)).splitlines()
    assert one.split()[2:] == everything.split()[1:]
    failures, issues, places, far, turned, missing, same, _, read, _, imported = numbers(everything)
    assert (failures, issues, missing, imported) == (1, 0, 0, 2)
    assert (far < 0.02, turned < 0.01) == (True, True)
    assert read == there
    if shutil.which("esmini"):
        assert (places > 100, same) == (True, 1)


def test_transfer(play: Play) -> None:
    """One test at one place, in each form."""
    said = play(
        "transfer", "--tests", "1", "--runs", "8", "--places", "1", "--seeds", "1",
        "--net", "crossing",
    )  # fmt: skip
    lines = said.splitlines()
    assert lines[0].startswith("1 minimal tests")
    assert [line.split("|")[1:3] for line in lines[3::2]] == [
        [" crossing, in the zone ", " 1 "],
        [" crossing, in the phase ", " 1 "],
    ]
