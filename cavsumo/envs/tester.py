"""cavsumo/Tester-v0: the tester learns, the scenario's ego drives."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cavsumo.agents.casting import teams, tester_bodies
from cavsumo.agents.observations import entries
from cavsumo.envs.base import OneLearner
from cavsumo.envs.episodes import team_name
from cavsumo.envs.settings import Roles, prepared_for
from cavsumo.envs.spaces import observation_space, team_space


class TesterEnv(OneLearner):
    """One learner owns all testers and looks for a test: a body in the ego's reaction zone.

    Observation, action, reward and info are described in docs/environments.md. The other keywords
    are the settings of a scenario file.

    Args:
        config: a scenario file; keywords win over it.
        until: "game": the episode is terminated when the game is, at its goal or in a dead end;
            "verdict": it goes on, for no more reward, until the verdict, as in ``cavsumo run``.
        actions: "effectors": throttle and steering of each body in [-1, 1]; "targets": for each
            body to stand, or where to walk, as Q-learning's (pedestrians only).
        reward: "game": that of the testers' game; "grade": how near the episode came to a
            preventable failure, at its end (needs until="verdict").
        hold: for how many timesteps an action lasts; rewards are summed.
        process: "this", or "own" for a simulation in a process of its own.
        render_mode: "rgb_array" or None.

    Raises InputError when a setting is wrong.
    """

    def __init__(
        self,
        *,
        config: str | Path | None = None,
        until: str = "game",
        actions: str = "effectors",
        reward: str = "game",
        hold: int = 1,
        process: str = "this",
        render_mode: str | None = None,
        **settings: Any,
    ) -> None:
        named = "cavsumo/Tester-v0"
        drawn = render_mode is not None
        how: dict[str, Any] = {"until": until, "actions": actions, "reward": reward}
        roles = Roles(hold=hold, drawn=drawn, named=named, **how)
        prepared = prepared_for(roles, config, settings, one_team=True)
        bodies = tester_bodies(prepared.plan.scenario)
        (team,) = teams(prepared.plan.scenario)
        learner = team_name(bodies, team)
        super().__init__(prepared, roles, learner=learner, process=process, render_mode=render_mode)
        self.action_space = team_space(bodies, actions)
        kind = bodies[0].kind
        ego = roles.make_ego(prepared)
        self.observation_space = observation_space(
            entries(len(bodies), kind.v_max, ego.kind.steering_max)
        )
