"""Steps per second of the environments beside ``loop.play``, for the same episodes.

    python benchmarks/environments.py [--net FILE] [--agent NAME] [--episodes N]

An agent plays episodes, its actions are noted, and then they are played again: by ``play`` with an
agent that reads them from a list, and by ``cavsumo/Tester-v0`` in this process and in one of its
own. With ``hold`` every fifth action lasts for five timesteps, so those episodes are others. All
take turns, so that the noise of the machine hits them alike: trust the ratios. Restarts of SUMO do
not count; observations are made, nothing is learned.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from cavsumo.agents import AGENTS, Agent
from cavsumo.envs.tester import TesterEnv
from cavsumo.model.bodies import Action, kind_named
from cavsumo.model.seeds import episode_seed
from cavsumo.model.snapshot import Snapshot
from cavsumo.simulation.loop import EpisodeLoop
from cavsumo.simulation.setup import Setup, make_setup

ROOT = Path(__file__).resolve().parent.parent
ROUNDS = 3  # the fastest counts
HOLD = 5
STEP_S = 0.1
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
    held = TesterEnv(net=options.net, until="verdict", hold=HOLD)
    setup = make_setup(here.prepared.plan.scenario, here.prepared.site)
    noted = {seed: note(setup, options.agent, seed) for seed in seeds}
    names = ("play", "env", f"env, hold={HOLD}", "env, own process")
    spent, steps = dict.fromkeys(names, 0.0), dict.fromkeys(names, 0)
    for seed, actions in noted.items():
        ways: dict[str, Callable[[], tuple[float, int]]] = {
            "play": lambda a=actions, s=seed: play_seconds(setup, a, s),
            "env": lambda a=actions, s=seed: env_seconds(here, a, s),
            f"env, hold={HOLD}": lambda a=actions, s=seed: env_seconds(held, a[::HOLD], s),
            "env, own process": lambda a=actions, s=seed: env_seconds(elsewhere, a, s),
        }
        for name, way in ways.items():
            seconds, count = min(way() for _ in range(ROUNDS))
            spent[name], steps[name] = spent[name] + seconds, steps[name] + count
    for closed in (here, elsewhere, held, setup):
        closed.close()
    net, total = Path(options.net).name, steps["play"]
    print(f"{net}, {options.agent}, {options.episodes} episodes, {total} timesteps")
    rates = {name: steps[name] / spent[name] for name in names}
    for name, rate in rates.items():
        print(f"{name:18} {rate:7.0f} timesteps/s  {rate / rates['play']:5.2f} of play")


def note(setup: Setup, agent: str, seed: int) -> Actions:
    """The actions of an agent that owns all bodies, in an episode."""
    player = AGENTS.make(agent, {})
    choose, noted = player.choose_action, []

    def noting(snapshot: Snapshot) -> tuple[Action, ...]:
        noted.append(choose(snapshot))
        return noted[-1]

    player.choose_action = noting  # type: ignore[method-assign]
    loop = EpisodeLoop(setup, [player], seed)
    while not loop.over:
        loop.step()
    return noted


def play_seconds(setup: Setup, actions: Actions, seed: int) -> tuple[float, int]:
    """How long the simulator takes, and for how many timesteps."""
    loop = EpisodeLoop(setup, [Told(actions)], seed)
    begun = time.perf_counter()
    while not loop.over:
        loop.step()
    return time.perf_counter() - begun, len(actions)


def env_seconds(env: TesterEnv, actions: Actions, seed: int) -> tuple[float, int]:
    """How long an environment takes, and for how many timesteps."""
    kind = kind_named(env.prepared.plan.scenario.kind)
    limits = np.array([kind.throttle_max, kind.steering_max] * len(actions[0]))
    scaled = [np.array(joint).reshape(-1) / limits for joint in actions]
    env.reset(seed=seed)
    begun = time.perf_counter()
    info: dict[str, Any] = {}
    for action in scaled:
        *_, terminated, truncated, info = env.step(action)
        if terminated or truncated:
            break
    return time.perf_counter() - begun, round(info["time_s"] / STEP_S)


if __name__ == "__main__":
    main()
