"""Episodes of one scenario played step by step, with some roles controlled by the caller.

This is the part of an environment that has SUMO; it may live in another process (``remote``).
"""

from __future__ import annotations

import os
import weakref
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from cavsumo.agents.observations import TeamObserver
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.envs.commanded import CommandedAgent, CommandedEgo
from cavsumo.envs.ego_observations import EgoObserver
from cavsumo.envs.ego_rewards import EgoRewardMonitor
from cavsumo.envs.events import EventDetector
from cavsumo.envs.grading import final_grade
from cavsumo.envs.settings import Roles
from cavsumo.envs.spaces import Vector
from cavsumo.errors import SimulationError, SimulationTaken
from cavsumo.model.bodies import Body
from cavsumo.model.snapshot import Snapshot
from cavsumo.simulation.loop import EpisodeLoop
from cavsumo.simulation.setup import Setup, make_setup

EGO = "ego"


class Seen(NamedTuple):
    """The result of a step for the roles that the caller controls.

    Attributes:
        observations, rewards: by role: "ego", and the names of the teams (``team_name``).
        terminated: the game ended or the verdict is there.
        truncated: the horizon came first.
        info: events and figures, made anew each time.
    """

    observations: dict[str, Vector]
    rewards: dict[str, float]
    terminated: bool
    truncated: bool
    info: dict[str, Any]


def team_name(bodies: Sequence[Body], team: Sequence[int]) -> str:
    """The name of a team: that of its body, or those of its first and last."""
    first, last = bodies[team[0]].id, bodies[team[-1]].id
    return first if first == last else f"{first}-{last.removeprefix('tester')}"


class Episodes:
    """One episode after another; SUMO is started by the first ``reset``."""

    def __init__(self, prepared: PreparedBatch, roles: Roles) -> None:
        self._prepared, self._roles = prepared, roles
        self._setup: Setup | None = None
        self._loop: EpisodeLoop | None = None

    def reset(self, seed: int) -> Seen:
        """Begin the episode that ``cavsumo run`` plays with this seed."""
        if self._setup is None:
            self._set_up()
        assert self._setup is not None
        self._loop = None
        setup = self._setup
        loop = EpisodeLoop(setup, self._agents, seed, keep=self._roles.reward == "grade")
        scene = loop.scene
        self._observers = [TeamObserver(scene, team) for team in setup.teams if self._commanded]
        self._ego_observer = EgoObserver(scene)
        self._rewards = EgoRewardMonitor(scene, loop.snapshot, steers=self._steers)
        self._watch = EventDetector(loop, setup.assertions)
        self._loop, self._game_over, self._left, self._seed = loop, False, False, seed
        info = self._watch.info() | {"seed": seed}
        return Seen(self._observations(), {}, False, False, info)

    def step(self, actions: Mapping[str, Sequence[float]]) -> Seen:
        """Move on for as many timesteps as an action lasts, or until the episode ends.

        Args:
            actions: by role, as ``spaces.numbers`` gives them.
        """
        loop, setup = self._loop, self._setup
        if loop is None or setup is None:
            raise SimulationError("no episode is under way; reset first")
        self._tell(actions)
        rewards = dict.fromkeys(self._names, 0.0)
        ended = self._ended()
        for _ in range(self._roles.hold):
            if any(ended):  # it was decided before the first action
                break
            self._advance(loop, rewards)
            ended = self._ended()
        info = self._watch.info()
        if any(ended):
            info["summary"] = self._watch.summary()
            if self._roles.reward == "grade":
                rewards |= dict.fromkeys(self._teams, self._graded(loop, setup))
            self._loop = None
        return Seen(self._observations(), rewards, *ended, info)

    def snapshot(self) -> Snapshot:
        """The snapshot of the present state."""
        return self._watch.loop.snapshot

    def close(self) -> None:
        """End SUMO and the ego's processes and connections."""
        self._loop = None
        if self._setup is not None:
            self._end()
            self._setup = None

    def _set_up(self) -> None:
        """Set up the scenario, without starting SUMO, and build the agents and the ego."""
        prepared, roles = self._prepared, self._roles
        ego = roles.make_ego(prepared)
        self._commanded_ego = ego if isinstance(ego, CommandedEgo) else None
        self._steers = self._commanded_ego is not None and self._commanded_ego.steers
        setup = make_setup(prepared.plan.scenario, prepared.site, ego)
        self._commanded: list[CommandedAgent] = []
        if roles.agent is None:
            self._commanded = [
                CommandedAgent(roles.actions, sees_background=roles.drawn) for _ in setup.teams
            ]
        self._agents = self._commanded or prepared.cast.agents(roles.agent or "")
        teams = [team_name(setup.bodies, team) for team in setup.teams if self._commanded]
        self._teams = tuple(teams)
        self._names = (*teams, EGO) if self._commanded_ego else self._teams
        self._end = weakref.finalize(self, _end, setup, os.getpid())  # if nobody calls close
        ego.prepare(setup.mission)
        self._setup = setup

    def _tell(self, actions: Mapping[str, Sequence[float]]) -> None:
        """Set the actions of the agents and of the ego."""
        for name, commanded in zip(self._teams, self._commanded, strict=True):
            commanded.told = actions[name]
        if self._commanded_ego is not None:
            self._commanded_ego.told = actions[EGO]

    def _advance(self, loop: EpisodeLoop, rewards: dict[str, float]) -> None:
        """One timestep, and the rewards of all roles in it."""
        assert self._setup is not None
        before = loop.snapshot
        try:
            feedback = loop.step()
        except SimulationTaken as error:
            raise SimulationTaken(
                "this process has one simulation, and another environment or world took it; reset "
                "this one, or play with process='own' or in an AsyncVectorEnv"
            ) from error
        self._left = loop.snapshot is before
        if feedback is not None:
            self._game_over = feedback[1]
            if self._roles.reward == "game":
                for name, reward in zip(self._teams, feedback[0], strict=False):
                    rewards[name] += reward
        if self._commanded_ego is not None:
            successor = None if self._left else loop.snapshot
            judgements = [a.judgement for a in self._setup.assertions]
            rewards[EGO] += self._rewards.reward(successor, judgements)

    def _ended(self) -> tuple[bool, bool]:
        """Whether the episode is terminated, and whether it is truncated."""
        loop, setup = self._loop, self._setup
        assert loop is not None
        assert setup is not None
        if self._rewards.off_road or (self._game_over and self._roles.until == "game"):
            return True, False
        if not loop.over:
            return False, False
        decided = self._left or all(a.decided for a in setup.assertions)
        return decided, not decided

    def _graded(self, loop: EpisodeLoop, setup: Setup) -> float:
        """The grade of the episode that has ended."""
        return final_grade(loop, setup, self._agents, self._seed, self._prepared.plan.reference)

    def _observations(self) -> dict[str, Vector]:
        """The observation of each role."""
        loop = self._watch.loop
        views = loop.agent_views if self._observers else ()
        seen = {
            name: observer.vector(view)
            for name, observer, view in zip(self._teams, self._observers, views, strict=True)
        }
        if self._commanded_ego is not None:
            seen[EGO] = self._ego_observer.vector(loop.ego_view)
        return seen


def _end(setup: Setup, owner: int) -> None:
    """Close a setup in the process that made it; a fork has only a copy of it."""
    if os.getpid() == owner:
        setup.close()
