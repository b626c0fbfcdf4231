"""Scripts of benchmarks/ about probabilities and games, at their smallest size."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from scripts_played import Play, numbers
from support import ROOT

from cavsumo.probability import learned_splitting, shifted

pytestmark = pytest.mark.usefixtures("inline")


def test_rare_events(play: Play) -> None:
    """Two replications of one process: the truth, and a gain."""
    _, row = play("rare_events", "--p3", "0.003", "--replications", "2").splitlines()
    assert numbers(row)[0] == 1.141e-05
    assert numbers(row)[6] > 1e3
    assert row.endswith("p3 0.003")


def test_estimators(play: Play) -> None:
    """Two replications of each method on each function; probabilities are known."""
    _, *found = play("estimators", "--replications", "2", "--episodes", "200").splitlines()
    assert [row.split()[2] for row in found[:6]] == [
        "auto", "monte-carlo", "stratified", "importance", "sobol", "subset",
    ]  # fmt: skip
    words = "--replications", "2", "--half-width", "5", "--method", "monte-carlo"
    _, early = play("estimators", *words, "--function", "corners").splitlines()
    assert float(early.split()[7]) < 2000
    assert {row.split()[0]: row.split()[1] for row in found} == {
        "corner": "1.0e-04", "corners": "1.0e-03", "ball": "1.2e-04", "scattered": "1.0e-03",
        "pedestrian": found[-7].split()[1], "lights": "2.1e-03",
    }  # fmt: skip


def test_estimates(play: Play, tmp_path: Path) -> None:
    """A truth, and two estimates of few episodes by each method; those that are kept are read."""
    file = tmp_path / "estimates.jsonl"
    words = "--net", "pedestrians", "--ego", "constant", "--truth", "20"
    words += "--replications", "2", "--episodes", "20"
    words += "--method", "auto", "--method", "monte-carlo", "--estimates", str(file)
    truth, _, *methods = play("estimates", *words).splitlines()
    assert truth.startswith("truth: ")
    assert " in 20 episodes of " in truth
    assert [row.split()[0] for row in methods] == ["auto", "monte-carlo"]
    kept = [json.loads(line) for line in file.read_text("utf-8").splitlines()]
    assert [one["key"]["seed"] for one in kept] == [1001, 1002, 1001, 1002]
    kept[0]["found"]["looks"][-1]["p"] = 2.0
    file.write_text("".join(f"{json.dumps(one)}\n" for one in kept), "utf-8")
    again = play("estimates", *words).splitlines()
    assert again[3] == methods[1]
    assert again[2] != methods[0]
    assert len(file.read_text("utf-8").splitlines()) == 4


def test_estimates_beside_a_kept_truth(play: Play) -> None:
    """Blocks of the long run are the estimates of Monte Carlo; another network is refused."""
    kept = "--kept", str(ROOT / "benchmarks" / "truth" / "crossing.json")
    truth, _, row = play("estimates", *kept, "--method", "monte-carlo").splitlines()
    assert truth.startswith("truth: 178 failures in 100000 episodes")
    assert row.split()[:2] == ["monte-carlo", "1.00"]
    with pytest.raises(SystemExit, match="is of net crossing, not junction"):
        play("estimates", *kept, "--net", "junction")


def test_drivers_under_an_exposure(play: Play, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two drivers, ten episodes each."""
    monkeypatch.syspath_prepend(str(ROOT / "experiments" / "search"))
    monkeypatch.setenv("PYTHONPATH", str(ROOT / "experiments" / "search"))
    words = "--net", "pedestrians", "--ego", "constant", "--ego", "faulty_drivers:Careful"
    _, _, *rows = play("exposed_drivers", *words, "--max-episodes", "10").splitlines()
    assert [row.split(" | ")[0] for row in rows] == ["| constant", "| Careful"]
    assert all(row.split(" | ")[2] == "10" for row in rows)
    assert rows[1].split(" | ")[3] == "0"


def test_crosswalks(play: Play, monkeypatch: pytest.MonkeyPatch) -> None:
    """One estimate by each method on a starting point, with a truth that is given."""
    monkeypatch.setattr(shifted, "LEARNED", (500,))
    monkeypatch.setattr(learned_splitting, "ROUNDS", 1)
    words = "start-2", "--counted", "107", "10000", "--runs", "200", "--replications", "1"
    truth, _, *found = play("crosswalks", *words).splitlines()
    assert truth.startswith("start-2: 107 failures in 10000 episodes: 0.0107 [")
    assert [row.split()[0] for row in found] == ["shifts", "splitting"]
    assert all(numbers(row)[4] > 1000 for row in found)


def test_ast_crosswalk(play: Play) -> None:
    """A few episodes of each starting point, and one draw of each in SUMO."""
    lines = play("ast_crosswalk", "--episodes", "50", "--sumo", "1").splitlines()[1:]
    assert [line.split()[0] for line in lines] == ["start-1", "start-2", "start-3"]
    assert all("of 50" in line and line.endswith("alike 1") for line in lines)


def test_games(play: Play) -> None:
    """A small problem of each sort, without Storm."""
    said = play("games", "--mdp", "8", "--game", "16", "--rounds", "1", "--no-storm")
    assert [line.split()[:2] for line in said.splitlines()[1:3]] == [
        ["MDP", "120"],
        ["game", "1200"],
    ]
