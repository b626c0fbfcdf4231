"""Episodes of one scenario played step by step, some roles moved from outside.

This is the part of an environment that has SUMO; it may live in another process (``elsewhere``).
"""

from __future__ import annotations

import os
import weakref
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from cavsumo.agents.observations import TeamObserver
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.envs.ego_observations import EgoObserver
from cavsumo.envs.ego_rewards import EgoLedger
from cavsumo.envs.events import EventDetector
from cavsumo.envs.puppets import PuppetAgent, PuppetEgo
from cavsumo.envs.settings import Roles
from cavsumo.envs.spaces import Vector
from cavsumo.errors import SimulationError, SimulationTaken
from cavsumo.model.bodies import Body
from cavsumo.model.snapshot import Snapshot
from cavsumo.simulation.loop import EpisodeLoop
from cavsumo.simulation.setup import Setup, make_setup

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
        loop = EpisodeLoop(setup, self._agents, seed)
        scene = loop.scene
        self._observers = [TeamObserver(scene, team) for team in setup.teams if self._puppets]
        self._ego_observer = EgoObserver(scene)
        self._rewards = EgoLedger(scene, loop.snapshot, steers=self._steers)
        self._watch = EventDetector(loop, setup.assertions)
        self._loop, self._game_over, self._left = loop, False, False
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
            if any(ended):  # it was decided before anybody moved
                break
            self._advance(loop, rewards)
            ended = self._ended()
        info = self._watch.info()
        if any(ended):
            info["summary"] = self._watch.summary()
            self._loop = None
        return Seen(self._observations(), rewards, *ended, info)

    def snapshot(self) -> Snapshot:
        """What there is to be seen now."""
        return self._watch.loop.snapshot

    def close(self) -> None:
        """End SUMO and whatever the ego started."""
        self._loop = None
        if self._setup is not None:
            self._end()
            self._setup = None

    def _set_up(self) -> None:
        """Set up the scenario, without starting SUMO, and build the agents and the ego."""
        prepared, roles = self._prepared, self._roles
        ego = roles.make_ego(prepared)
        self._puppet_ego = ego if isinstance(ego, PuppetEgo) else None
        self._steers = self._puppet_ego is not None and self._puppet_ego.steers
        setup = make_setup(prepared.plan.scenario, prepared.site, ego)
        self._puppets: list[PuppetAgent] = []
        if roles.agent is None:
            self._puppets = [
                PuppetAgent(roles.actions, sees_background=roles.drawn) for _ in setup.teams
            ]
        self._agents = self._puppets or prepared.cast.agents(roles.agent or "")
        teams = [team_name(setup.bodies, team) for team in setup.teams if self._puppets]
        self._teams = tuple(teams)
        self._names = (*teams, EGO) if self._puppet_ego else self._teams
        self._end = weakref.finalize(self, _end, setup, os.getpid())  # if nobody calls close
        ego.prepare(setup.mission)
        self._setup = setup

    def _tell(self, actions: Mapping[str, Sequence[float]]) -> None:
        """Tell the puppets what to do."""
        for name, puppet in zip(self._teams, self._puppets, strict=True):
            puppet.told = actions[name]
        if self._puppet_ego is not None:
            self._puppet_ego.told = actions[EGO]

    def _advance(self, loop: EpisodeLoop, rewards: dict[str, float]) -> None:
        """One timestep, and what everybody earned in it."""
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
            for name, reward in zip(self._teams, feedback[0], strict=False):
                rewards[name] += reward
        if self._puppet_ego is not None:
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

    def _observations(self) -> dict[str, Vector]:
        """What each role is shown now."""
        loop = self._watch.loop
        views = loop.agent_views if self._observers else ()
        seen = {
            name: observer.vector(view)
            for name, observer, view in zip(self._teams, self._observers, views, strict=True)
        }
        if self._puppet_ego is not None:
            seen[EGO] = self._ego_observer.vector(loop.ego_view)
        return seen


def _end(setup: Setup, owner: int) -> None:
    """Close a setup in the process that made it; a fork has only a copy of it."""
    if os.getpid() == owner:
        setup.close()
