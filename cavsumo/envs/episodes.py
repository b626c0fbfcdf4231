"""Episodes of one scenario played step by step, some roles moved from outside.

This is the part of an environment that has SUMO; it may live in another process (``elsewhere``).
"""

from __future__ import annotations

import os
import weakref
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from cavsumo.agents.casting import make_agents
from cavsumo.agents.observations import Observer
from cavsumo.batch.prepared import Setting
from cavsumo.envs.ego_observations import EgoObserver
from cavsumo.envs.ego_rewards import EgoLedger
from cavsumo.envs.events import Watch
from cavsumo.envs.puppets import PuppetAgent, PuppetEgo
from cavsumo.envs.settings import Roles
from cavsumo.envs.spaces import Vector
from cavsumo.errors import SimulationError, SimulationTaken
from cavsumo.model.bodies import Body
from cavsumo.model.snapshot import Snapshot
from cavsumo.simulation.loop import Performance
from cavsumo.simulation.setup import Stage, set_stage

EGO = "ego"


class Seen(NamedTuple):
    """What those who move something get back.

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
    """What a team is called: as its body, or as its first and last."""
    first, last = bodies[team[0]].id, bodies[team[-1]].id
    return first if first == last else f"{first}-{last.removeprefix('tester')}"


class Episodes:
    """One episode after another; SUMO is started by the first ``reset``."""

    def __init__(self, setting: Setting, roles: Roles) -> None:
        self._setting, self._roles = setting, roles
        self._stage: Stage | None = None
        self._performance: Performance | None = None

    def reset(self, seed: int) -> Seen:
        """Begin the episode that ``cavsumo run`` plays with this seed."""
        if self._stage is None:
            self._set_up()
        assert self._stage is not None
        self._performance = None
        stage = self._stage
        performance = Performance(stage, self._agents, seed)
        scene = performance.scene
        self._observers = [Observer(scene, team) for team in stage.teams if self._puppets]
        self._ego_observer = EgoObserver(scene)
        self._ledger = EgoLedger(scene, performance.snapshot, steers=self._steers)
        self._watch = Watch(performance, stage.assertions)
        self._performance, self._game_over, self._left = performance, False, False
        info = self._watch.info() | {"seed": seed}
        return Seen(self._observations(), {}, False, False, info)

    def step(self, actions: Mapping[str, Sequence[float]]) -> Seen:
        """Move on for as many timesteps as an action lasts, or until the episode ends.

        Args:
            actions: by role, as ``spaces.numbers`` gives them.
        """
        performance, stage = self._performance, self._stage
        if performance is None or stage is None:
            raise SimulationError("no episode is under way; reset first")
        self._tell(actions)
        rewards = dict.fromkeys(self._names, 0.0)
        ended = self._ended()
        for _ in range(self._roles.hold):
            if any(ended):  # it was decided before anybody moved
                break
            self._advance(performance, rewards)
            ended = self._ended()
        info = self._watch.info()
        if any(ended):
            info["summary"] = self._watch.summary()
            self._performance = None
        return Seen(self._observations(), rewards, *ended, info)

    def snapshot(self) -> Snapshot:
        """What there is to be seen now."""
        return self._watch.performance.snapshot

    def close(self) -> None:
        """End SUMO and whatever the ego started."""
        self._performance = None
        if self._stage is not None:
            self._end()
            self._stage = None

    def _set_up(self) -> None:
        """Set the stage, without starting SUMO, and cast the roles."""
        setting, roles = self._setting, self._roles
        ego = roles.make_ego(setting)
        self._puppet_ego = ego if isinstance(ego, PuppetEgo) else None
        self._steers = self._puppet_ego is not None and self._puppet_ego.steers
        stage = set_stage(setting.plan.scenario, setting.site, ego)
        self._puppets: list[PuppetAgent] = []
        if roles.agent is None:
            self._puppets = [
                PuppetAgent(roles.actions, sees_background=roles.drawn) for _ in stage.teams
            ]
        self._agents = self._puppets or make_agents(setting.plan, roles.agent or "")
        teams = [team_name(stage.bodies, team) for team in stage.teams if self._puppets]
        self._teams = tuple(teams)
        self._names = (*teams, EGO) if self._puppet_ego else self._teams
        self._end = weakref.finalize(self, _end, stage, os.getpid())  # if nobody calls close
        ego.prepare(stage.mission)
        self._stage = stage

    def _tell(self, actions: Mapping[str, Sequence[float]]) -> None:
        """Tell the puppets what to do."""
        for name, puppet in zip(self._teams, self._puppets, strict=True):
            puppet.told = actions[name]
        if self._puppet_ego is not None:
            self._puppet_ego.told = actions[EGO]

    def _advance(self, performance: Performance, rewards: dict[str, float]) -> None:
        """One timestep, and what everybody earned in it."""
        assert self._stage is not None
        before = performance.snapshot
        try:
            feedback = performance.step()
        except SimulationTaken as error:
            raise SimulationTaken(
                "this process has one simulation, and another environment or world took it; reset "
                "this one, or play with process='own' or in an AsyncVectorEnv"
            ) from error
        self._left = performance.snapshot is before
        if feedback is not None:
            self._game_over = feedback[1]
            for name, reward in zip(self._teams, feedback[0], strict=False):
                rewards[name] += reward
        if self._puppet_ego is not None:
            successor = None if self._left else performance.snapshot
            judgements = [a.judgement for a in self._stage.assertions]
            rewards[EGO] += self._ledger.reward(successor, judgements)

    def _ended(self) -> tuple[bool, bool]:
        """Whether the episode is terminated, and whether it is truncated."""
        performance, stage = self._performance, self._stage
        assert performance is not None
        assert stage is not None
        if self._ledger.off_road or (self._game_over and self._roles.until == "game"):
            return True, False
        if not performance.over:
            return False, False
        decided = self._left or all(a.decided for a in stage.assertions)
        return decided, not decided

    def _observations(self) -> dict[str, Vector]:
        """What each role is shown now."""
        performance = self._watch.performance
        views = performance.agent_views if self._observers else ()
        seen = {
            name: observer.vector(view)
            for name, observer, view in zip(self._teams, self._observers, views, strict=True)
        }
        if self._puppet_ego is not None:
            seen[EGO] = self._ego_observer.vector(performance.ego_view)
        return seen


def _end(stage: Stage, owner: int) -> None:
    """Close a stage in the process that set it up; a fork has only a copy of it."""
    if os.getpid() == owner:
        stage.close()
