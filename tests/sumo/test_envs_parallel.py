"""The PettingZoo environment: testers and ego move at the same time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from pettingzoo.test import parallel_api_test, parallel_seed_test
from support import SHORT, STRAIGHT_NET

from cavsumo.envs import parallel_env
from cavsumo.errors import AgentError, InputError
from cavsumo.simulation.rewards import GOAL

Make = Callable[..., Any]


@pytest.fixture
def make() -> Iterator[Make]:
    """Call with settings for an environment in this process, closed afterwards."""
    made = []

    def one(**settings: Any) -> Any:
        made.append(parallel_env(**(SHORT | {"process": "this"} | settings)))
        return made[-1]

    yield one
    for env in made:
        env.close()


def crossing(env: Any, seed: int) -> list[Any]:
    """An episode in which all testers set out across the road and the ego keeps its speed."""
    env.reset(seed=seed)
    steps = []
    while env.agents:
        steps.append(env.step({a: [0.0] if a == "ego" else [1] for a in env.agents}))
    return steps


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("zero_sum", [True, False])
def test_pettingzoos_own_check_passes_without_a_warning(make: Make, zero_sum: bool) -> None:
    """Agents, spaces, dictionaries, seeds and options."""
    parallel_api_test(make(zero_sum=zero_sum), num_cycles=150)


def test_two_environments_stepped_in_turns_are_the_same() -> None:
    """PettingZoo's seed test, for which each has a process of its own, as by default."""
    parallel_seed_test(lambda: parallel_env(**SHORT, testers=1), num_cycles=30)


def test_an_agent_for_each_team_and_the_ego(make: Make) -> None:
    """Named after their bodies; their spaces are those of the Gymnasium environments."""
    env = make()
    assert env.possible_agents == ["tester0", "tester1", "tester2", "ego"]
    assert env.action_space("tester1").shape == (2,)
    assert env.observation_space("ego").shape == (59,)
    assert make(testers=4, bodies_per_agent=2).possible_agents == ["tester0-1", "tester2-3", "ego"]
    env.reset(seed=1)
    with pytest.raises(AgentError, match="ego: no action given"):
        env.step({name: np.zeros(2) for name in env.agents if name != "ego"})
    env.close()
    with pytest.raises(ResetNeeded):
        env.step({})


def test_the_ego_loses_what_the_testers_win(make: Make) -> None:
    """Zero-sum at every step; the goal goes to who reached it and ends the game for all."""
    env = make(actions="targets", depart_speed=8.0, end=20.0)
    found = next(s for i in range(40) if (s := crossing(env, i))[-1][4]["ego"]["outcome"] == "held")
    for _, rewards, *_ in found:
        assert sum(rewards.values()) == pytest.approx(0.0)
    _, rewards, terminated, truncated, infos = found[-1]
    winner = infos["ego"]["events"][0]["tester"]
    assert [name for name, reward in rewards.items() if reward > 0] == [winner]
    assert rewards[winner] > GOAL - 1
    assert all(terminated.values())
    assert not any(truncated.values())
    assert not infos["ego"]["summary"]["decided"]


def test_an_ego_with_rewards_of_its_own_plays_on_to_the_verdict(make: Make) -> None:
    """The same episode without the zero sum: the ego earns its way, until all is decided."""
    env = make(actions="targets", depart_speed=8.0, end=20.0, zero_sum=False)
    found = next(s for i in range(40) if (s := crossing(env, i))[-1][4]["ego"]["outcome"] == "held")
    assert found[0][1]["ego"] == pytest.approx(0.7)
    assert found[-1][4]["tester0"]["summary"]["decided"]
    goals = [i for i, s in enumerate(found) if any(r > 50 for r in s[1].values())]
    assert len(goals) == 1
    assert goals[0] < len(found) - 1
    assert all(found[-1][1][f"tester{i}"] == 0.0 for i in range(3)), "the testers' game is over"


def test_wrong_settings_are_refused_in_a_sentence() -> None:
    """As those of the Gymnasium environments."""
    with pytest.raises(InputError, match="unknown keyword 'nett'; did you mean 'net'"):
        parallel_env(nett=STRAIGHT_NET)
    with pytest.raises(InputError, match="divide testers 3"):
        parallel_env(net=STRAIGHT_NET, bodies_per_agent=2)
    with pytest.raises(InputError, match="ego_params: the ego is moved by"):
        parallel_env(net=STRAIGHT_NET, ego_params={"tau": 1})
