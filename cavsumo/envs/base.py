"""The common part of both Gymnasium environments: one learner, all others by the scenario."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from cavsumo.batch.prepared import PreparedBatch
from cavsumo.envs.episodes import Episodes, Seen
from cavsumo.envs.remote import RemoteEpisodes
from cavsumo.envs.settings import PROCESSES, Roles
from cavsumo.envs.spaces import ActionSpace, Vector, numbers
from cavsumo.errors import InputError
from cavsumo.model.checks import choice

RENDER_MODES = ("rgb_array",)


class RunningScenario:
    """A prepared batch whose scenario is played, in this process or another, and its pictures."""

    def __init__(self, prepared: PreparedBatch, roles: Roles, process: str) -> None:
        try:
            choice("process", process, PROCESSES)
        except ValueError as error:
            raise InputError(f"{roles.named}: {error}") from error
        self.episodes = (Episodes if process == "this" else RemoteEpisodes)(prepared, roles)
        scenario = prepared.plan.scenario
        self.fps = max(1, round(1.0 / (scenario.step_length * roles.hold)))
        self._painter: Any = None
        if roles.drawn:
            from cavsumo.envs.painting import Painter

            self._painter = Painter(prepared)

    def picture(self) -> NDArray[np.uint8]:
        """The picture of the present state."""
        picture: NDArray[np.uint8] = self._painter.paint(self.episodes.snapshot())
        return picture


class OneLearner(gymnasium.Env[Any, Any]):
    """A Gymnasium environment in which the caller controls one role.

    Attributes:
        prepared: the scenario, checked, and its site.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 10}  # noqa: RUF012
    action_space: ActionSpace
    observation_space: spaces.Box

    def __init__(
        self,
        prepared: PreparedBatch,
        roles: Roles,
        *,
        learner: str,
        process: str,
        render_mode: str | None,
    ) -> None:
        check_render_mode(render_mode, roles.named)
        self.prepared, self.render_mode, self._learner = prepared, render_mode, learner
        self._play = RunningScenario(prepared, roles, process)
        self.metadata = {**type(self).metadata, "render_fps": self._play.fps}
        self._under_way = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Vector, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: the episode's, with which ``cavsumo run`` plays the same one; without, the next
                one is drawn from ``np_random``. It is in ``info["seed"]`` in either case.
            options: none.
        """
        super().reset(seed=seed)
        if seed is None:
            seed = int(self.np_random.integers(2**32))
        self._under_way = False
        seen = self._play.episodes.reset(seed)
        self._under_way = True
        return seen.observations[self._learner], seen.info

    def step(self, action: Any) -> tuple[Vector, float, bool, bool, dict[str, Any]]:
        """Move on; an action outside its box is clamped to it, an invalid one is refused."""
        if not self._under_way:
            raise ResetNeeded(f"{self._learner}: the episode is over or has not begun; reset first")
        values = numbers(action, self.action_space, self._learner)
        seen: Seen = self._play.episodes.step({self._learner: values})
        self._under_way = not (seen.terminated or seen.truncated)
        reward = seen.rewards[self._learner]
        return (
            seen.observations[self._learner],
            reward,
            seen.terminated,
            seen.truncated,
            seen.info,
        )

    def render(self) -> NDArray[np.uint8] | None:
        """The scene from above, uint8 of shape (540, 720, 3), with render_mode "rgb_array"."""
        if self.render_mode is None:
            return None
        return self._play.picture()

    def close(self) -> None:
        """End the simulation."""
        self._under_way = False
        self._play.episodes.close()


def check_render_mode(mode: str | None, who: str) -> None:
    """Raise InputError for an unknown render mode."""
    if mode is not None and mode not in RENDER_MODES:
        raise InputError(f"{who}: render_mode must be rgb_array or None, got {mode!r}")
