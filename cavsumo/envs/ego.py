"""cavsumo/Ego-v0: the ego learns, a registered agent moves the testers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cavsumo.envs.base import OneLearner
from cavsumo.envs.commanded import CommandedEgo
from cavsumo.envs.ego_observations import entries
from cavsumo.envs.episodes import EGO
from cavsumo.envs.settings import Roles, prepared_for
from cavsumo.envs.spaces import normalised, observation_space


class EgoEnv(OneLearner):
    """The learner drives the ego along its route and should pass the tests it meets.

    Observation, action, reward and info are described in docs/environments.md. The other keywords
    are the settings of a scenario file.

    Args:
        agent: the registered agent that moves the testers; ``params`` are its parameters.
        control: "acceleration" (SUMO keeps the ego on its route) or "drive" (throttle and
            steering, by the kinematics).
        max_speed: the ego drives no faster [m/s].
        depart_speed: its first speed [m/s]; None for the largest that SUMO considers safe.
        config, hold, process, render_mode: as for ``TesterEnv``.

    Raises InputError when a setting is wrong.
    """

    def __init__(
        self,
        *,
        agent: str = "timing",
        control: str = "acceleration",
        max_speed: float = 50 / 3.6,
        depart_speed: float | None = None,
        config: str | Path | None = None,
        hold: int = 1,
        process: str = "this",
        render_mode: str | None = None,
        **settings: Any,
    ) -> None:
        driver = {"control": control, "max_speed": max_speed, "depart_speed": depart_speed}
        roles = Roles(
            agent=agent,
            ego=driver,
            until="verdict",
            hold=hold,
            drawn=render_mode is not None,
            named="cavsumo/Ego-v0",
        )
        prepared = prepared_for(roles, config, settings, one_team=False)
        super().__init__(prepared, roles, learner=EGO, process=process, render_mode=render_mode)
        ego = CommandedEgo(**driver)  # type: ignore[arg-type]
        self.action_space = normalised(2 if ego.steers else 1)
        self.observation_space = observation_space(entries(ego.kind))
