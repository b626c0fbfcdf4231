"""Sensors in whole episodes with real SUMO: what they change, and what they must not."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support import frame, prepared_at, rows, traces

from cavsumo.agents import AGENTS, Agent
from cavsumo.agents.casting import resolve_cast
from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import job
from cavsumo.cli import main
from cavsumo.errors import InputError, UnknownName
from cavsumo.model.scenario import BatchPlan, plan_from
from cavsumo.model.scenario_file import read_config
from cavsumo.model.seeds import episode_seed
from cavsumo.model.sensors import Sensor
from cavsumo.model.snapshot import Snapshot
from cavsumo.network.site import Site
from cavsumo.simulation.loop import EpisodeLoop, play
from cavsumo.simulation.setup import make_setup

Staged = Callable[..., tuple[BatchPlan, Site]]
Writer = Callable[..., str]
BAD_EYES = {
    "range_m": 30.0,
    "position_noise_m": 0.5,
    "heading_noise_rad": 0.1,
    "speed_noise_mps": 0.5,
    "delay_s": 0.3,
    "occlusion": True,
}
GENTLE = """
from cavsumo.egos import Acceleration
from cavsumo.egos.time_gap import TimeGapEgo

class Gentle(TimeGapEgo):
    \"\"\"Sees who is in its way and brakes with 3 m/s2 at most.\"\"\"

    def act(self, snapshot):
        return Acceleration(max(-3.0, super().act(snapshot).value))
"""


def words(option: str, sensor: dict[str, Any]) -> list[str]:
    """A sensor on the command line."""
    return [w for k, v in sensor.items() for w in (option, f"{k}={str(v).lower()}")]


def outcomes(plan: BatchPlan, site: Site) -> list[str]:
    """Of a batch, played in this process; an error says what it was."""
    with EpisodeRunner(prepared_at(plan, site)) as runner:
        found = [runner.play(job(plan, run)).outcome.row for run in range(plan.runs)]
    return [row.get("error") or row["outcome"] for row in found]


def test_a_controller_that_sees_less_fails_more(staged: Staged, controller: Writer) -> None:
    """A leader stops 25 m ahead: one that brakes gently copes, unless it sees 15 m only."""
    ahead = {"kind": "car", "testers": 1, "agents": ["proximity"], "runs": 6, "trace": "none"}
    ahead |= {"ego": f"{controller(GENTLE)}:Gentle"}
    ahead |= {"params": {"manoeuvre": "brake", "distance_m": 25.0}}
    full, near = (
        outcomes(*staged(**ahead, **sensor)) for sensor in ({}, {"ego_sensor": {"range_m": 15.0}})
    )
    assert full.count("violated") == 0, full
    assert near.count("violated") >= 4, near


@pytest.mark.parametrize("where", ["ego_sensor", "tester_sensor"])
def test_who_does_not_look_is_not_changed(staged: Staged, where: str) -> None:
    """Nobody else's numbers change: the same starts, choices, traffic and frames as without."""
    settings = {"ego": "constant", "agents": ["random"], "routes": "auto"}
    frames = []
    for sensor in ({}, {where: BAD_EYES}):
        plan, site = staged("crossing", **settings, **sensor)
        setup = make_setup(plan.scenario, site)
        try:
            episode = play(setup, resolve_cast(plan).agents("random"), 5, record=True)
        finally:
            setup.close()
        frames.append(list(map(frame, episode.frames)))
    assert frames[0] == frames[1]
    assert len(frames[0]) > 20


class Witness(Agent):
    """Notes what it is shown."""

    def __init__(self) -> None:
        self.seen: list[Snapshot] = []
        self.fed: list[tuple[Snapshot, Snapshot]] = []

    def choose_action(self, snapshot: Snapshot) -> Any:
        self.seen.append(snapshot)
        return super().choose_action(snapshot)

    def process_feedback(self, snapshot, action, reward, successor, terminal):  # type: ignore
        self.fed.append((snapshot, successor))


def test_everybody_is_shown_views_and_the_rest_the_truth(
    staged: Staged, controller: Writer
) -> None:
    """The same views for choosing and for learning, one for each observer, the truth beside."""
    plan, site = staged("crossing", ego="time-gap", routes="auto", testers=2,
                        ego_sensor={"range_m": 20.0}, tester_sensor=BAD_EYES)  # fmt: skip
    setup, agents = make_setup(plan.scenario, site), [Witness(), Witness()]
    try:
        loop = EpisodeLoop(setup, agents, episode_seed(1, 0))
        assert len(loop.snapshot.lights) == len(site.lights)
        for step in range(60):
            truth, views = loop.snapshot, loop.agent_views
            loop.step()
            assert truth.unseen is None
            assert [a.seen[-1] for a in agents] == list(views)
            for i, view in enumerate(views):
                assert (view.step, view.time) == (truth.step, truth.time) == (step, view.time)
                assert [t.id for t in view.testers] == ["tester0", "tester1"]
                assert view.testers[i] is truth.testers[i]
                assert len(view.lights) == len(site.lights)
                assert len(view.background) <= len(truth.background)
        for agent in agents:
            assert [a for a, _ in agent.fed] == agent.seen
            assert [b for _, b in agent.fed][:-1] == agent.seen[1:]
        assert loop.ego_view.ego == loop.snapshot.ego
        assert len(loop.ego_view.background) < len(loop.snapshot.background)
    finally:
        setup.close()


@pytest.mark.parametrize("agent", sorted(set(AGENTS) - {"noop"}))
def test_every_walker_copes_with_bad_eyes(staged: Staged, agent: str) -> None:
    """No agent that comes with cavsumo trips over what a sensor shows it.

    Who takes another tester to be half a metre from where it is may walk into it.
    """
    plan, site = staged(
        agents=[agent], runs=3, tester_sensor=BAD_EYES, ego="time-gap", ego_sensor=BAD_EYES,
        trace="none",
    )  # fmt: skip
    assert set(outcomes(plan, site)) <= {"held", "violated", "not_triggered", "unfair", "invalid"}


@pytest.mark.parametrize("agent", ["timing", "proximity", "election", "programmed-random"])
def test_every_driver_copes_with_bad_eyes(staged: Staged, agent: str) -> None:
    """Vehicles too, several of them on one road; they still get near the ego."""
    plan, site = staged(
        "crossing", kind="car", testers=4, bodies_per_agent=2, agents=[agent], runs=2, end=25.0,
        tester_sensor=BAD_EYES, trace="none", routes="auto",
    )  # fmt: skip
    assert set(outcomes(plan, site)) <= {"held", "violated", "not_triggered", "unfair"}


def test_a_batch_is_the_same_for_any_number_of_processes(
    networks: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    """Rows and traces byte for byte, other ones than without sensors, and each can be replayed."""
    monkeypatch.chdir(tmp_path)
    common = ["run", "-n", str(networks["pedestrians"]), "--ego", "time-gap", "--runs", "2", "-q"]
    common += ["--exit-zero", "--trace", "all", "--traffic", "6"]
    eyes = words("--ego-sensor", BAD_EYES | {"range_m": 12}) + words("--tester-sensor", BAD_EYES)
    assert main([*common, *eyes, "-o", "one.csv"]) == 0
    assert main([*common, *eyes, "-o", "two.csv", "-j", "2"]) == 0
    assert main([*common, "-o", "full.csv"]) == 0
    one, two, full = (Path(f"{name}.csv") for name in ("one", "two", "full"))
    same = [{**row, "trace": row["trace"].partition("/")[2]} for row in rows(one)]
    assert same == [{**row, "trace": row["trace"].partition("/")[2]} for row in rows(two)]
    assert list(traces(one).values()) == list(traces(two).values())
    assert rows(one)[0]["seed"] == rows(full)[0]["seed"]
    assert [r["min_gap_m"] for r in rows(one)] != [r["min_gap_m"] for r in rows(full)]
    capsys.readouterr()
    assert main(["replay", "one.csv", "1"]) == 0
    assert "same" in capsys.readouterr().out


# What can be asked for


def test_sensors_stand_in_scenario_files(networks: dict[str, Path], tmp_path: Path) -> None:
    """As tables; what is not named is perfect, and a perfect sensor is none."""
    file = tmp_path / "s.toml"
    file.write_text(
        f'net = "{networks["crossing"]}"\n'
        "ego_sensor = { range_m = 50, delay_s = 0.2, occlusion = true }\n"
        "[tester_sensor]\nrange_m = 30.5\n",
        encoding="utf-8",
    )
    scenario = plan_from(read_config(file), "test").scenario
    assert scenario.ego_sensor == Sensor(range_m=50.0, delay_s=0.2, occlusion=True)
    assert scenario.tester_sensor == Sensor(range_m=30.5)
    perfect = {"delay_s": 0.0, "occlusion": False}
    plan = plan_from({"net": networks["crossing"], "ego_sensor": perfect}, "test")
    assert plan == plan_from({"net": networks["crossing"]}, "test")
    again = BatchPlan.model_validate(plan_from(read_config(file), "test").model_dump(mode="json"))
    assert again.scenario == scenario


@pytest.mark.parametrize("option", ["--ego-sensor", "--tester-sensor"])
@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("rang_m=3", "did you mean 'range_m'?"),
        ("range_m=0", "range_m: Input should be greater than 0, got 0"),
        ("range_m=inf", "range_m: Input should be a finite number, got inf"),
        ("range_m=far", "range_m: Input should be a valid number, got 'far'"),
        ("range_m=true", "range_m: Input should be a valid number, got True"),
        ("position_noise_m=-1", "position_noise_m: Input should be greater than or equal to 0"),
        ("heading_noise_rad=4", "heading_noise_rad: Input should be less than or equal to 3.14"),
        ("speed_noise_mps=nan", "speed_noise_mps: Input should be a finite number, got nan"),
        ("delay_s=11", "delay_s: Input should be less than or equal to 10, got 11"),
        ("occlusion=1", "occlusion: Input should be a valid boolean, got 1"),
        ("occlusion", "expected KEY=VALUE, got 'occlusion'"),
    ],
)
def test_bad_sensors_are_one_sentence(
    refused: Callable[..., str], option: str, word: str, said: str
) -> None:
    """It names the sensor, the key and what was expected; nothing is written."""
    sentence = refused("--ego", "time-gap", option, word)
    assert said in sentence
    assert option.removeprefix("--").replace("-", "_") in sentence.replace("-", "_")


def test_what_is_no_sensor_in_a_file_is_refused(networks: dict[str, Path]) -> None:
    """A number, or a key that no sensor has."""
    with pytest.raises(InputError, match=r"ego_sensor: .*got 50"):
        plan_from({"net": networks["crossing"], "ego_sensor": 50}, "test")
    with pytest.raises(UnknownName, match=r"unknown key of tester_sensor 'delay'.*'delay_s'"):
        plan_from({"net": networks["crossing"], "tester_sensor": {"delay": 1}}, "test")


def test_a_sensor_that_is_no_table_is_refused_with_options_too(
    networks: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Before the command line's keys are put into it."""
    file = tmp_path / "s.toml"
    file.write_text(f'net = "{networks["crossing"]}"\nego_sensor = 50\n', encoding="utf-8")
    assert main(["run", "-c", str(file), "--ego-sensor", "delay_s=1"]) == 2
    assert "ego_sensor: expected a table" in capsys.readouterr().err


def test_sumos_driver_has_no_sensor(refused: Callable[..., str]) -> None:
    """It sees through SUMO, so a sensor would change nothing without a word."""
    assert "needs a controller" in refused("--ego-sensor", "range_m=20")
