"""Steps per second of the environments beside ``simulator.play``, for the same episodes.

    python benchmarks/environments.py [--net FILE] [--agent NAME] [--episodes N]

An agent plays episodes, its actions are noted, and then they are played again: by ``play`` with an
agent that reads them from a list, and by ``cavsumo/Tester-v0`` in this process and in one of its
own. All take turns, so that the noise of the machine hits them alike: trust the ratios. Restarts of
SUMO do not count; observations are made, nothing is learned.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from cavsumo.agents import AGENTS, Agent
from cavsumo.bodies import Action, kind_named
from cavsumo.envs.tester import TesterEnv
from cavsumo.jobs import episode_seed
from cavsumo.simulator import Performance
from cavsumo.snapshot import Snapshot
from cavsumo.stage import Stage, set_stage

ROOT = Path(__file__).resolve().parent.parent
ROUNDS = 3  # the fastest counts
Actions = list[tuple[Action, ...]]


class Told(Agent):
    """Does what a list says."""

    sees_background = False

    def __init__(self, actions: Actions) -> None:
        self._actions = iter(actions)

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        return next(self._actions)


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--net", default=str(ROOT / "networks" / "crossing.net.xml"))
    parser.add_argument("--agent", default="timing")
    parser.add_argument("--episodes", type=int, default=20)
    options = parser.parse_args()
    seeds = [episode_seed(1, i) for i in range(options.episodes)]
    here = TesterEnv(net=options.net, until="verdict")
    elsewhere = TesterEnv(net=options.net, until="verdict", process="own")
    stage = set_stage(here.setting.plan.scenario, here.setting.site)
    noted = {seed: note(stage, options.agent, seed) for seed in seeds}
    spent = {name: 0.0 for name in ("play", "env", "env, own process")}
    for seed, actions in noted.items():
        ways: dict[str, Callable[[], float]] = {
            "play": lambda a=actions, s=seed: play_seconds(stage, a, s),
            "env": lambda a=actions, s=seed: env_seconds(here, a, s),
            "env, own process": lambda a=actions, s=seed: env_seconds(elsewhere, a, s),
        }
        for name, way in ways.items():
            spent[name] += min(way() for _ in range(ROUNDS))
    for closed in (here, elsewhere, stage):
        closed.close()
    steps = sum(map(len, noted.values()))
    print(f"{Path(options.net).name}, {options.agent}, {options.episodes} episodes, {steps} steps")
    for name, seconds in spent.items():
        print(f"{name:18} {steps / seconds:7.0f} steps/s  {spent['play'] / seconds:5.2f} of play")


def note(stage: Stage, agent: str, seed: int) -> Actions:
    """The actions of an agent that owns all bodies, in an episode."""
    player = AGENTS.make(agent, {})
    choose, noted = player.choose_action, []

    def noting(snapshot: Snapshot) -> tuple[Action, ...]:
        noted.append(choose(snapshot))
        return noted[-1]

    player.choose_action = noting  # type: ignore[method-assign]
    performance = Performance(stage, [player], seed)
    while not performance.over:
        performance.step()
    return noted


def play_seconds(stage: Stage, actions: Actions, seed: int) -> float:
    """How long the simulator takes for the timesteps."""
    performance = Performance(stage, [Told(actions)], seed)
    begun = time.perf_counter()
    while not performance.over:
        performance.step()
    return time.perf_counter() - begun


def env_seconds(env: TesterEnv, actions: Actions, seed: int) -> float:
    """How long an environment takes for the same."""
    kind = kind_named(env.setting.plan.scenario.kind)
    limits = np.array([kind.throttle_max, kind.steering_max] * len(actions[0]))
    scaled = [np.array(joint).reshape(-1) / limits for joint in actions]
    env.reset(seed=seed)
    begun = time.perf_counter()
    ended: Any = False
    for action in scaled:
        *_, ended, cut, _ = env.step(action)
        ended = ended or cut
    assert ended, "the episodes differ"
    return time.perf_counter() - begun


if __name__ == "__main__":
    main()
