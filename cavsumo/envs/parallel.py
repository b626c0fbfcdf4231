"""Testers and ego as PettingZoo agents that act at the same time, as in the seed's game."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from numpy.typing import NDArray

from cavsumo.agents import observations
from cavsumo.agents.casting import teams, tester_bodies
from cavsumo.envs import ego_observations
from cavsumo.envs.base import RENDER_MODES, RunningScenario, check_render_mode
from cavsumo.envs.commanded import CommandedEgo
from cavsumo.envs.episodes import EGO, Seen, team_name
from cavsumo.envs.settings import Roles, prepared_for
from cavsumo.envs.spaces import (
    ActionSpace,
    Vector,
    normalised,
    numbers,
    observation_space,
    team_space,
)
from cavsumo.errors import AgentError, InputError

try:
    from pettingzoo import ParallelEnv
except ModuleNotFoundError as error:
    raise InputError("parallel_env needs PettingZoo: pip install 'cavsumo[pettingzoo]'") from error


class CavsumoParallelEnv(ParallelEnv[str, Vector, Any]):  # type: ignore[misc]
    """One agent for each team of testers ("tester0", ...; see ``bodies_per_agent``), and "ego".

    All of them live until the episode ends. Spaces, rewards and info are described in
    docs/environments.md. The other keywords are the settings of a scenario file.

    Args:
        zero_sum: the ego's reward is the negative of the testers', as in the seed's game; else it
            is that of cavsumo/Ego-v0.
        until: "game" or "verdict" as for ``TesterEnv``; by default "game" if it is zero-sum,
            because there is no reward after that, else "verdict".
        process: "own", or "this" for a faster simulation in this process, which has only one.
        control, max_speed, depart_speed: as for ``EgoEnv``.
        config, actions, hold, render_mode: as for ``TesterEnv``.

    Raises InputError when a setting is wrong.
    """

    metadata: ClassVar[dict[str, Any]] = {
        "name": "cavsumo_v0",
        "render_modes": list(RENDER_MODES),
        "render_fps": 10,
        "is_parallelizable": True,
    }

    def __init__(
        self,
        *,
        zero_sum: bool = True,
        until: str | None = None,
        control: str = "acceleration",
        max_speed: float = 50 / 3.6,
        depart_speed: float | None = None,
        config: str | Path | None = None,
        actions: str = "effectors",
        hold: int = 1,
        process: str = "own",
        render_mode: str | None = None,
        **settings: Any,
    ) -> None:
        driver = {"control": control, "max_speed": max_speed, "depart_speed": depart_speed}
        named = "cavsumo.envs.parallel_env"
        check_render_mode(render_mode, named)
        roles = Roles(
            ego=driver,
            until=until or ("game" if zero_sum else "verdict"),
            hold=hold,
            actions=actions,
            drawn=render_mode is not None,
            named=named,
        )
        self.prepared = prepared_for(roles, config, settings, one_team=False)
        self.render_mode, self._zero_sum = render_mode, zero_sum
        self._play = RunningScenario(self.prepared, roles, process)
        self.metadata = {**type(self).metadata, "render_fps": self._play.fps}  # type: ignore[misc]
        self._spaces = self._made_spaces(CommandedEgo(**driver), actions)  # type: ignore[arg-type]
        self.possible_agents = list(self._spaces)
        self.agents: list[str] = []
        self._np_random: np.random.Generator | None = None

    def _made_spaces(
        self, ego: CommandedEgo, actions: str
    ) -> dict[str, tuple[spaces.Box, ActionSpace]]:
        """The spaces of observations and actions of each agent."""
        scenario = self.prepared.plan.scenario
        bodies = tester_bodies(scenario)
        made: dict[str, tuple[spaces.Box, ActionSpace]] = {}
        for team in teams(scenario):
            owned = [bodies[i] for i in team]
            v_max, steering = owned[0].kind.v_max, ego.kind.steering_max
            shown = observation_space(observations.entries(len(owned), v_max, steering))
            made[team_name(bodies, team)] = shown, team_space(owned, actions)
        shown = observation_space(ego_observations.entries(ego.kind))
        made[EGO] = shown, normalised(2 if ego.steers else 1)
        return made

    def observation_space(self, agent: str) -> spaces.Box:
        """The observation space of an agent."""
        return self._spaces[agent][0]

    def action_space(self, agent: str) -> ActionSpace:
        """The action space of an agent."""
        return self._spaces[agent][1]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Vector], dict[str, dict[str, Any]]]:
        """Begin an episode; the seed is that of ``OneLearner.reset``."""
        if seed is not None or self._np_random is None:
            self._np_random, _ = seeding.np_random(seed)
        if seed is None:
            seed = int(self._np_random.integers(2**32))
        self.agents = []
        seen = self._play.episodes.reset(seed)
        self.agents = list(self.possible_agents)
        return seen.observations, self._infos(seen)

    def step(
        self, actions: Mapping[str, Any]
    ) -> tuple[
        dict[str, Vector],
        dict[str, float],
        dict[str, bool],
        dict[str, bool],
        dict[str, dict[str, Any]],
    ]:
        """All agents act at once; actions as in ``OneLearner.step``, one for each agent."""
        if not self.agents:
            raise ResetNeeded("the episode is over or has not begun; reset first")
        for name in self.agents:
            if name not in actions:
                raise AgentError(f"{name}: no action given; all agents move at the same time")
        chosen = {n: numbers(actions[n], self._spaces[n][1], n) for n in self.agents}
        seen = self._play.episodes.step(chosen)
        rewards = seen.rewards
        if self._zero_sum:
            rewards[EGO] = -math.fsum(reward for name, reward in rewards.items() if name != EGO)
        terminated = dict.fromkeys(self.agents, seen.terminated)
        truncated = dict.fromkeys(self.agents, seen.truncated)
        infos = self._infos(seen)
        if seen.terminated or seen.truncated:
            self.agents = []
        return seen.observations, rewards, terminated, truncated, infos

    def _infos(self, seen: Seen) -> dict[str, dict[str, Any]]:
        """The same information for every agent, each with a copy of its own."""
        return {
            name: seen.info | {"events": [dict(event) for event in seen.info["events"]]}
            for name in self.possible_agents
        }

    def render(self) -> NDArray[np.uint8] | None:
        """The scene from above, as ``OneLearner.render``."""
        return None if self.render_mode is None else self._play.picture()

    def close(self) -> None:
        """End the simulation."""
        self.agents = []
        self._play.episodes.close()
