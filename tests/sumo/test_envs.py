"""The Gymnasium environments: what the ecosystem's checks ask, and the same episodes as a batch."""

from __future__ import annotations

import itertools
import math
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from support import SHORT, STRAIGHT_NET

from cavsumo.agents import AGENTS
from cavsumo.agents.observations import entries
from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import Job
from cavsumo.egos import make_ego
from cavsumo.egos.base import Acceleration, Command
from cavsumo.envs import parallel_env, tester
from cavsumo.envs.discrete import DiscreteActions
from cavsumo.envs.ego import EgoEnv
from cavsumo.envs.ego_observations import entries as ego_entries
from cavsumo.envs.ego_rewards import HARSH_COST, OFF_ROAD, PROGRESS, TIME_COST, VIOLATION
from cavsumo.errors import AgentError, InputError, SimulationTaken
from cavsumo.model.bodies import CAR, PEDESTRIAN
from cavsumo.model.snapshot import Snapshot
from cavsumo.results.rows import cell
from cavsumo.simulation.loop import EpisodeLoop
from cavsumo.simulation.rewards import GOAL, ROAD_COST
from cavsumo.simulation.setup import make_setup
from cavsumo.sumo.world import World

NEAR = {"range_m": 3.0}
IDS = ("cavsumo/Tester-v0", "cavsumo/Ego-v0")
Make = Callable[..., Any]


def to_the_end(env: Any, actions: Iterator[Any] | None = None) -> list[Any]:
    """What every step of the rest of an episode returns, with sampled actions if none are given."""
    steps = []
    for action in actions or (env.action_space.sample() for _ in itertools.count()):
        steps.append(env.step(action))
        if steps[-1][2] or steps[-1][3]:
            break
    return steps


# What Gymnasium asks


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", IDS)
def test_gymnasiums_own_check_passes_without_a_warning(name: str) -> None:
    """Spaces, seeds, determinism, rendering, fresh data: all that ``check_env`` looks at."""
    check_env(gymnasium.make(name, render_mode="rgb_array", **SHORT).unwrapped)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", ["Tester", "Ego"])
def test_the_wrappers_of_make_have_nothing_to_say(name: str, make: Make) -> None:
    """A whole episode under the passive checker, with statistics recorded beside the summary."""
    env = gymnasium.wrappers.RecordEpisodeStatistics(make(name))
    _, info = env.reset(seed=4)
    assert info["seed"] == 4
    steps = to_the_end(env)
    rewards = [step[1] for step in steps]
    last = steps[-1][4]
    assert last["episode"]["r"] == pytest.approx(sum(rewards), abs=1e-4)
    assert last["summary"]["steps"] == last["episode"]["l"]
    assert not any("summary" in step[4] for step in steps[:-1])


# The same episodes as a batch


def test_a_tester_moved_from_outside_gives_the_row_of_a_batch(
    set_up: Callable[..., Any], make: Make
) -> None:
    """The starts, and with an agent's actions every column, are those of ``cavsumo run``."""
    prepared = set_up("pedestrians", bodies_per_agent=3, trace="none", agents=("timing",), end=20.0)
    seed = 6
    with EpisodeRunner(prepared) as runner:
        row = runner.play(Job(0, "timing", seed)).outcome.row
        noted = _tester_actions(runner, seed)
    env = make(until="verdict", end=20.0)
    env.reset(seed=seed)
    steps = to_the_end(env, iter(noted))
    summary = steps[-1][4]["summary"]
    assert summary.pop("decided")
    assert {k: cell(v) for k, v in summary.items()} == {k: cell(row[k]) for k in summary}
    assert sum(step[1] for step in steps) == pytest.approx(row["reward"], abs=1e-9)
    assert row["outcome"] in ("held", "violated"), "an episode in which something happens"
    times = [e["time_s"] for step in steps for e in step[4]["events"] if e["event"] == "trigger"]
    assert times == [row["trigger_time_s"]]


def test_the_grade_of_an_episode_may_be_the_reward(set_up: Callable[..., Any], make: Make) -> None:
    """That of the row, judged by the reference driver, at the end and nothing before."""
    how, seed = {"ego": "constant", "end": 20.0}, 6
    batch = {"bodies_per_agent": 3, "trace": "none", "agents": ("timing",), "reference": "human"}
    with EpisodeRunner(set_up("pedestrians", **batch, **how)) as runner:
        row = runner.play(Job(0, "timing", seed)).outcome.row
        noted = _tester_actions(runner, seed)
    assert (row["outcome"], row["avoidable"] in (0, 1)) == ("violated", True)
    env = make(until="verdict", reward="grade", **how)
    env.reset(seed=seed)
    *before, last = [step[1] for step in to_the_end(env, iter(noted))]
    assert not any(before)
    assert last == pytest.approx(row["grade"])
    with pytest.raises(InputError, match="reward 'grade' needs until='verdict'"):
        make(reward="grade")


def _tester_actions(runner: EpisodeRunner, seed: int) -> list[Any]:
    """The actions of the timing agent in an episode, from -1 to 1."""
    agent = AGENTS.make("timing", {})
    choose, noted = agent.choose_action, []

    def noting(snapshot: Snapshot) -> Any:
        noted.append(choose(snapshot))
        return noted[-1]

    agent.choose_action = noting  # type: ignore[method-assign]
    loop = EpisodeLoop(runner.setup, [agent], seed)
    while not loop.over:
        loop.step()
    limits = [PEDESTRIAN.throttle_max, PEDESTRIAN.steering_max] * 3
    return [np.array(joint).reshape(-1) / limits for joint in noted]


def test_an_ego_driven_from_outside_gives_the_row_of_a_batch(
    set_up: Callable[..., Any], make: Make
) -> None:
    """With the answers of a controller every column is that of ``cavsumo run`` with it."""
    prepared = set_up("pedestrians", ego="time-gap", trace="none", agents=("proximity",), end=20.0)
    ego, noted, seed = make_ego("time-gap", {}), [], 3
    act = ego.act

    def noting(snapshot: Snapshot) -> Command:
        command = act(snapshot)
        assert isinstance(command, Acceleration)
        noted.append([command.value / 9.0])
        return command

    with EpisodeRunner(prepared) as runner:
        row = runner.play(Job(0, "proximity", seed)).outcome.row
    ego.act = noting  # type: ignore[method-assign]
    setup = make_setup(prepared.plan.scenario, prepared.site, ego)
    loop = EpisodeLoop(setup, [AGENTS.make("proximity", {}) for _ in range(3)], seed)
    while not loop.over:
        loop.step()
    setup.close()
    env = make("Ego", agent="proximity", depart_speed=8.33, max_speed=55.0, end=20.0)
    env.reset(seed=seed)
    summary = to_the_end(env, iter(noted))[-1][4]["summary"]
    assert summary.pop("decided")
    assert {k: cell(v) for k, v in summary.items()} == {k: cell(row[k]) for k in summary}


def test_a_seed_makes_an_episode_and_its_successors(make: Make) -> None:
    """Same seed, same bits to the end; without one, the next is drawn and told."""

    def played(seed: int | None) -> tuple[list[bytes], int]:
        shown, info = env.reset(seed=seed)
        action = np.tile(np.array([1.0, 0.3], dtype=np.float32), 3)
        steps = to_the_end(env, itertools.repeat(action, 40))
        return [shown.tobytes(), *(s[0].tobytes() for s in steps)], info["seed"]

    env = make()
    first, second = played(5), played(None)
    assert played(5) == first
    assert played(None) == second
    assert played(second[1])[0] == second[0]
    assert first[0] != second[0]


# One simulation a process


def test_who_begins_an_episode_takes_the_simulation(make: Make) -> None:
    """The other one says so instead of returning what is not its own, and can begin again."""
    one, other, action = make(), make("Ego"), np.zeros(6, dtype=np.float32)
    shown, _ = one.reset(seed=1)
    one.step(action)  # the other one was made, but has not begun
    other.reset(seed=1)
    with pytest.raises(
        SimulationTaken, match="another environment or world took it; reset this one"
    ):
        one.step(action)
    other.step(np.zeros(1, dtype=np.float32))
    assert np.array_equal(one.reset(seed=1)[0], shown)
    other.close()  # has nothing to end any more
    one.step(action)


def test_a_world_beside_an_environment_takes_the_simulation_too(
    make: Make, open_world: Callable[..., World]
) -> None:
    """Whoever it is, nobody goes on in a simulation of somebody else's."""
    env = make()
    env.reset(seed=1)
    with open_world() as world:
        world.reset(1, (), ())
        with pytest.raises(SimulationTaken):
            env.step(np.zeros(6, dtype=np.float32))
        env.reset(seed=1)
        with pytest.raises(SimulationTaken, match="begin a new"):
            world.step((), None)
        world.reset(1, (), ())
    with pytest.raises(SimulationTaken):
        env.step(np.zeros(6, dtype=np.float32))
    env.reset(seed=1)


def test_an_environment_that_nobody_closed_closes_itself() -> None:
    """Dropping it is enough: no warning, no folder left."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = tester.TesterEnv(**SHORT)
        env.reset(seed=1)
        del env


# Rewards, actions, ends


def test_the_testers_earn_what_the_game_gives_them(make: Make) -> None:
    """Time and road cost; the goal is worth GOAL and ends the game before the verdict."""
    env = make(testers=1, start_speed=0.0, actions="targets", end=30.0)
    env.reset(seed=8)
    assert env.step([0])[1] == pytest.approx(-0.1)  # stands on the pavement
    steps = to_the_end(env, itertools.repeat([1]))
    on_road = [step for step in steps[:-1] if step[1] < -0.15]
    assert on_road, "it crosses"
    assert all(s[1] == pytest.approx(-0.1 - 0.1 * ROAD_COST) for s in on_road)
    assert steps[-1][2] is True

    seeds = iter(range(50))  # a walker who just sets out seldom meets the ego: look for one
    found = next(e for s in seeds if (e := _walked(env, s))[-1][4]["outcome"] == "held")
    assert found[-1][1] == pytest.approx(GOAL - 0.1 - 0.1 * ROAD_COST)
    assert found[-1][2] is True
    summary = found[-1][4]["summary"]
    assert not summary["decided"]
    assert [e["event"] for e in found[-1][4]["events"]] == ["trigger"]


def _walked(env: Any, seed: int) -> list[Any]:
    """An episode in which a pedestrian sets out across the road at once."""
    env.reset(seed=seed)
    return to_the_end(env, itertools.repeat([1]))


def test_an_action_lasts_as_long_as_asked(make: Make) -> None:
    """Five timesteps at once show and pay what five in turn do."""
    once, fivefold = make(), make(hold=5)
    action = np.tile(np.array([0.5, -0.2], dtype=np.float32), 3)
    once.reset(seed=6)
    singles = [once.step(action) for _ in range(10)]
    fivefold.reset(seed=6)
    steps = [fivefold.step(action) for _ in range(2)]
    for i, step in enumerate(steps):
        assert np.array_equal(step[0], singles[5 * i + 4][0])
        assert step[1] == pytest.approx(sum(s[1] for s in singles[5 * i : 5 * i + 5]))
        assert step[4]["time_s"] == singles[5 * i + 4][4]["time_s"]
    assert fivefold.unwrapped.metadata["render_fps"] == 2


def test_learners_see_through_their_sensors(make: Make) -> None:
    """A tester that sees 3 m far knows no speed of the ego; an ego that does, nobody around."""
    speed = [name for name, _, _ in entries(1, 1.0, 1.0)].index("ego.speed_mps")
    seen = [make(testers=1, **sensor).reset(seed=5)[0] for sensor in ({}, {"tester_sensor": NEAR})]
    assert seen[0][speed] > 0.0
    assert seen[1][speed] == 0.0
    present = [name for name, _, _ in ego_entries(CAR)].index("body0.present")
    around = [make("Ego", **sensor).reset(seed=5)[0] for sensor in ({}, {"ego_sensor": NEAR})]
    assert around[0][present] == 1.0
    assert around[1][present] == 0.0


def test_the_horizon_truncates(make: Make) -> None:
    """Nobody reached anything: neither goal nor dead end."""
    env = make(end=1.0)
    env.reset(seed=1)
    steps = to_the_end(env, itertools.repeat(np.tile([-1.0, 0.0], 3)))
    assert len(steps) == 10
    assert steps[-1][2:4] == (False, True)
    with pytest.raises(ResetNeeded):
        env.unwrapped.step(np.zeros(6))


def test_the_ego_leaving_is_a_dead_end(make: Make) -> None:
    """Whoever lets it pass has lost: terminated, with nothing but the costs."""
    env = make(end=60.0)
    env.reset(seed=1)
    steps = to_the_end(env, itertools.repeat(np.tile([-1.0, 0.0], 3)))
    assert steps[-1][2:4] == (True, False)
    assert steps[-1][4]["outcome"] == "not_triggered"
    assert sum(s[1] for s in steps) == pytest.approx(-0.1 * len(steps))


def test_the_ego_earns_its_way_and_pays_for_time_and_harshness(make: Make) -> None:
    """On an empty road at constant speed, then braking: the formula, and an impact that costs."""
    env = make("Ego", agent="noop", start_speed=0.0, depart_speed=8.0)
    env.reset(seed=1)
    assert env.step([0.0])[1] == pytest.approx(PROGRESS * 0.8 - TIME_COST * 0.1)
    braked = env.step([-1.0 / 3.0])[1]  # -3 m/s2: 0.1 s at 7.85 m/s on average
    assert braked == pytest.approx(PROGRESS * 0.785 - TIME_COST * 0.1 - HARSH_COST * 9 * 0.1)

    env = make("Ego", agent="timing", depart_speed=8.0, end=20.0)
    ends = []
    for seed in range(20):
        env.reset(seed=seed)
        ends.append(to_the_end(env, itertools.repeat([0.0]))[-1])
        if ends[-1][4]["outcome"] == "violated":
            break
    assert ends[-1][4]["outcome"] == "violated", "an ego that never brakes hits somebody"
    assert ends[-1][1] == pytest.approx(0.7 - VIOLATION)
    assert {"violation", "contact"} <= {e["event"] for e in ends[-1][4]["events"]}


def test_an_ego_that_steers_off_the_road_is_done(make: Make) -> None:
    """Terminated with a penalty; on the road its path lies ahead of it."""
    env = make("Ego", agent="noop", start_speed=0.0, control="drive", depart_speed=8.0)
    shown, _ = env.reset(seed=1)
    assert env.action_space.shape == (2,)
    assert shown[5:13:2] == pytest.approx(0.0, abs=1e-4)  # the path 5 to 40 m on is straight ahead
    steps = to_the_end(env, itertools.repeat([0.0, -1.0]))
    assert steps[-1][2] is True
    assert steps[-1][1] < -OFF_ROAD + 2
    assert steps[-2][0][4] < -0.3  # turned to the right of its path


def test_actions_beyond_the_box_are_clamped_and_what_is_none_is_refused(make: Make) -> None:
    """As learners expect of the former; the latter would hang SUMO."""
    env = make().unwrapped
    results = []
    for value in (1.0, 7.5):
        env.reset(seed=1)
        results.append(env.step(np.full(6, value))[0])
    assert np.array_equal(*results)
    for wrong in (np.full(6, math.nan), np.zeros(5), "left", None):
        with pytest.raises(AgentError, match="6 finite numbers"):
            env.step(wrong)
    targets = make(actions="targets").unwrapped
    targets.reset(seed=1)
    for wrong in ([0, 0, 5], [0.5, 0, 0], [-1, 0, 0]):
        with pytest.raises(AgentError, match="from 0 to 4"):
            targets.step(wrong)


def test_discrete_actions_are_rows_of_a_table(make: Make) -> None:
    """A grid over a box, or every combination of targets."""
    grid = DiscreteActions(make("Ego"), levels=5)
    assert grid.action_space.n == 5
    assert grid.table.ravel().tolist() == [-1.0, -0.5, 0.0, 0.5, 1.0]
    combined = DiscreteActions(make(testers=2, actions="targets"))
    assert combined.action_space.n == 25
    assert combined.table[7].tolist() == [1, 2]
    combined.reset(seed=1)
    shown = combined.step(7)[0]
    plain = make(testers=2, actions="targets")
    plain.reset(seed=1)
    assert np.array_equal(plain.step([1, 2])[0], shown)
    with pytest.raises(InputError, match="9765625 choices"):
        DiscreteActions(make(testers=5), levels=5)


# Settings


@pytest.mark.parametrize(
    ("kind", "settings", "said"),
    [
        (tester.TesterEnv, {"tester": 2}, "unknown keyword 'tester'; did you mean 'testers'?"),
        (tester.TesterEnv, {"net": None}, "name one with net=FILE"),
        (tester.TesterEnv, {"net": "nowhere.net.xml"}, "nowhere.net.xml"),
        (tester.TesterEnv, {"testers": 0}, "testers: Input should be greater than or equal to 1"),
        (tester.TesterEnv, {"bodies_per_agent": 1}, "one learner owns all 3 testers"),
        (tester.TesterEnv, {"ego": "sum"}, "did you mean 'sumo'?"),
        (tester.TesterEnv, {"params": {"x": 1}}, "params: the testers are moved by"),
        (tester.TesterEnv, {"hold": 0}, "hold must be a whole number of at least 1"),
        (tester.TesterEnv, {"until": "end"}, "until must be one of game, verdict"),
        (tester.TesterEnv, {"process": "other"}, "process must be one of this, own"),
        (tester.TesterEnv, {"actions": "words"}, "actions must be one of effectors, targets"),
        (tester.TesterEnv, {"render_mode": "human"}, "render_mode must be rgb_array"),
        (EgoEnv, {"agent": "timng"}, "did you mean 'timing'?"),
        (EgoEnv, {"agent": "q-learning"}, "a seed would not make an episode"),
        (EgoEnv, {"ego": "sumo"}, "ego: the ego is moved by"),
        (EgoEnv, {"control": "fly"}, "control must be one of acceleration, drive"),
        (EgoEnv, {"max_speed": math.nan}, "max_speed must be a finite number"),
        (EgoEnv, {"depart_speed": 20.0}, "depart_speed must lie in [0, 13.8889]"),
    ],
)
def test_wrong_settings_are_refused_in_a_sentence(
    kind: Any, settings: dict[str, Any], said: str
) -> None:
    """One sentence, before any simulation is started."""
    with pytest.raises(InputError) as refused:
        kind(**(SHORT | settings))
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_scenario_file_says_it_all(tmp_path: Path, make: Make) -> None:
    """Its batch settings are left aside; keywords win."""
    file = tmp_path / "scenario.toml"
    file.write_text(
        f'net = "{STRAIGHT_NET}"\nroutes = "none"\ntesters = 2\nend = 4.0\n'
        'runs = 9\nagents = ["random"]\n'
        '[params]\nrate_per_s = 2.0\n[ego_params]\ncarFollowModel = "IDM"\n',
        encoding="utf-8",
    )
    env = tester.TesterEnv(config=file, end=3.0)
    scenario = env.prepared.plan.scenario
    assert (scenario.testers, scenario.end, scenario.bodies_per_agent) == (2, 3.0, 2)
    assert scenario.ego_params == {"carFollowModel": "IDM"}
    assert EgoEnv(config=file, agent="random").prepared.plan.params == {"rate_per_s": 2.0}


# Pictures


def test_the_picture_shows_the_ego_and_what_is_around_it(make: Make) -> None:
    """From above, with road, zones and testers, following the ego."""
    env = make("Ego", agent="noop", depart_speed=8.0, render_mode="rgb_array", routes=None)
    env.reset(seed=3)
    picture = env.render()
    assert picture.shape == (540, 720, 3)
    assert picture.dtype == np.uint8
    colours = {tuple(c) for c in picture.reshape(-1, 3).tolist()}
    shown = {"ego": (31, 95, 168), "road": (139, 144, 150), "tester": (214, 64, 43)}
    assert {n for n, c in shown.items() if c in colours} == set(shown)
    ego = np.argwhere((picture == shown["ego"]).all(axis=2))
    env.step([0.0])
    moved = np.argwhere((env.render() == shown["ego"]).all(axis=2))
    assert np.abs(ego.mean(axis=0) - moved.mean(axis=0)).max() < 2.0
    # Heading east it is drawn 16 m, or 176 pixels, left of the middle.
    assert ego[:, 1].mean() == pytest.approx(360 - 176, abs=12)
    assert make().render_mode is None
    assert env.unwrapped.metadata["render_fps"] == 10


@pytest.mark.parametrize(
    ("package", "module", "extra"),
    [("PIL", "painting", "render"), ("pettingzoo", "parallel", "pettingzoo")],
)
def test_what_is_not_installed_is_said_at_once(
    package: str, module: str, extra: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the command that installs it."""
    monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.delitem(sys.modules, f"cavsumo.envs.{module}", raising=False)
    make = tester.TesterEnv if extra == "render" else parallel_env
    with pytest.raises(InputError, match=rf"pip install 'cavsumo\[{extra}\]'"):
        make(**SHORT, render_mode="rgb_array")
