"""The tester that plays solved games, in SUMO: what it says beforehand, and what comes out."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support import rows

from cavsumo.agents import AGENTS, Scene
from cavsumo.agents.base import NOT_FORCEABLE, SURE
from cavsumo.agents.planning.solved import solved
from cavsumo.cli import main
from cavsumo.model.bodies import PEDESTRIAN, Action
from cavsumo.model.kinematics import step_floats
from cavsumo.model.snapshot import Snapshot

MakeScene = Callable[..., Scene]
See = Callable[..., Snapshot]
State = tuple[float, float, float, float]

CONSTANT = ["--agent", "expectiminimax", "--ego", "constant"]
PLAIN = ["--reference", "none", "--exit-zero", "--seed", "5"]


@pytest.fixture(scope="module")
def played(networks: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Episodes with one pedestrian on the straight road."""
    file = tmp_path_factory.mktemp("expectiminimax") / "one.csv"
    words = ["run", "-n", str(networks["pedestrians"]), *CONSTANT, *PLAIN, "--testers", "1"]
    assert main([*words, "--runs", "9", "-o", str(file), "-q"]) == 0
    return file


def test_its_forecasts_come_true(played: Path) -> None:
    """Against an ego that keeps its speed every verdict is right, and both occur."""
    said = {(row["forecast"], row["outcome"]) for row in rows(played)}
    assert said == {(SURE, "violated"), (NOT_FORCEABLE, "not_triggered")}


def test_the_summary_says_what_it_promised(
    played: Path, networks: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With the class of egos, and beside the tests that came out; two at a time change nothing."""
    file = tmp_path / "one.csv"
    words = ["run", "-n", str(networks["pedestrians"]), *CONSTANT, *PLAIN, "--testers", "1"]
    assert main([*words, "--runs", "9", "-o", str(file), "-j", "2"]) == 0
    sure = sum(row["forecast"] == SURE for row in rows(played))
    assert (
        f"expectiminimax: of 9 starts {sure} are sure, 0 undecided, {9 - sure} not forceable "
        f"against egos of class constant; tests in {sure}, 0 and 0 of them"
    ) in capsys.readouterr().out
    assert rows(file) == rows(played)


def test_a_replay_is_the_same_without_the_stored_solution(
    played: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What lies in the cache changes nothing but time."""
    test = next(row["run"] for row in rows(played) if row["forecast"] == SURE)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    solved.cache_clear()  # what this process knows already
    assert main(["replay", str(played), test]) == 0
    assert list((tmp_path / "cavsumo").iterdir())


def test_two_bodies_are_one_agent(networks: dict[str, Path], tmp_path: Path) -> None:
    """One of them goes and the other stays out of the way, so no sure test is spoilt."""
    file = tmp_path / "pair.csv"
    words = ["run", "-n", str(networks["pedestrians"]), *CONSTANT, *PLAIN]
    teams = ["--testers", "2", "--bodies-per-agent", "2", "--runs", "6"]
    assert main([*words, *teams, "-o", str(file), "-q"]) == 0
    for row in rows(file):
        assert (row["forecast"] == SURE) == (row["outcome"] == "violated"), row


@pytest.mark.parametrize("against", ["unaware", "any"])
def test_it_plays_against_drivers_too(
    networks: dict[str, Path], tmp_path: Path, against: str
) -> None:
    """Nothing is known of SUMO's driver beforehand but what holds for its class."""
    file = tmp_path / "driver.csv"
    words = ["run", "-n", str(networks["crossing"]), "--agent", "expectiminimax", *PLAIN]
    params = ["--param", f"against={against}", "--param", "top=9", "--testers", "2"]
    assert main([*words, *params, "--runs", "1", "-o", str(file), "-q"]) == 0
    assert all(row["outcome"] != "error" and row["forecast"] for row in rows(file))


def test_agents_that_know_nothing_say_nothing(networks: dict[str, Path], tmp_path: Path) -> None:
    """Their columns stay empty."""
    file = tmp_path / "timing.csv"
    words = ["run", "-n", str(networks["pedestrians"]), "--agent", "timing", "--runs", "1"]
    assert main([*words, *PLAIN, "-o", str(file), "-q"]) == 0
    (row,) = rows(file)
    assert (row["forecast"], row["forecast_value"]) == ("", "")


def test_vehicles_are_refused(refused: Callable[..., str]) -> None:
    """Its game is one of pedestrians."""
    said = refused("--agent", "expectiminimax", "--kind", "car")
    assert "expectiminimax" in said
    assert "pedestrian" in said


@pytest.mark.parametrize("param", ["against=nobody", "grid_s=9", "accel=0", "top=no", "prize=1"])
def test_parameters_are_checked(refused: Callable[..., str], param: str) -> None:
    """What is no parameter, or none in its range, is refused by name."""
    assert param.partition("=")[0] in refused("--agent", "expectiminimax", "--param", param)


def drive(scene: Scene, see: See, states: list[State], v: float) -> list[tuple[float, State]]:
    """How the first body moves before an ego that keeps its speed: (ego's front, state)."""
    agent = AGENTS.make("expectiminimax", {})
    agent.reset(scene, tuple(range(len(states))), np.random.default_rng(1))
    x, course = 2.25, []
    for step in range(round(90.0 / v / scene.dt)):
        snapshot = see(scene, ego=(x, v), testers=states, step=step)
        if step == 0:
            agent.forecast(snapshot)
        actions: tuple[Action, ...] = agent.choose_action(snapshot)
        states = [
            step_floats(*s[1:], *a, PEDESTRIAN.wheelbase, 0.0, PEDESTRIAN.v_max, scene.dt)
            for s, a in zip(snapshot.testers, actions, strict=True)
        ]
        x += v * scene.dt
        course.append((x + 2.25, states[0]))
    return course


@pytest.mark.parametrize("v", [4.0, 6.75, 13.0])
def test_it_steps_in_late(straight_scene: MakeScene, scene_snapshot: See, v: float) -> None:
    """It waits at the kerb, comes into the strip within the reaction zone, and stands there."""
    scene = straight_scene(((70.0, -5.15, math.pi / 2),))
    course = drive(scene, scene_snapshot, [(70.0, -5.15, 0.0, math.pi / 2)], v)
    edge = -1.825 - 0.875 - 0.65625 / 2
    front, _ = next((f, s) for f, s in course if s[1] >= edge)
    gap = 70.0 - 0.875 / 2 - front
    braking = v * v / 18.0
    assert braking < gap <= braking + 0.675 * v
    waiting = [s for f, s in course if s[2] == 0.0 and s[1] < edge]
    assert all(s[1] + 0.65625 / 2 < -3.65 for s in waiting)


def test_it_does_not_spoil_what_is_lost(straight_scene: MakeScene, scene_snapshot: See) -> None:
    """Where the ego cannot be met in time the body stays off the road."""
    scene = straight_scene(((9.0, -5.15, math.pi / 2),))
    course = drive(scene, scene_snapshot, [(9.0, -5.15, 0.0, math.pi / 2)], 6.75)
    front = [s for f, s in course if f < 9.0 + 4.5 + 0.875]
    assert all(s[1] + 0.65625 / 2 < -3.65 for s in front)
