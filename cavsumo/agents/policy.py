"""Testers that a user trained: ``policy:FILE``, the format is that of ``policy_file``.

Such a tester is accepted in every place of the name of a registered one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cavsumo.agents.base import AGENTS, Agent
from cavsumo.agents.features import across, towards
from cavsumo.agents.names import policy_file
from cavsumo.agents.observations import TeamObserver
from cavsumo.agents.policy_file import TrainedPolicy, read_policy
from cavsumo.errors import InputError, UnknownName
from cavsumo.model.bodies import WALKING, Action, Kind
from cavsumo.model.objects import factory_of, is_object
from cavsumo.model.registry import Parameter, Registry
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot


def make_agent(spec: str, params: Mapping[str, Any]) -> Agent:
    """The registered agent of that name, the policy in ``policy:FILE``, or an object's."""
    if is_object(spec):
        return _own_agent(spec, params)
    file = policy_file(spec)
    if file is None:
        return AGENTS.make(spec, params)
    for key in params:
        raise UnknownName("parameter", key, (), f"agent {spec}")
    return PolicyAgent(read_policy(file))


def parameters_of(spec: str) -> list[Parameter]:
    """The parameters of an agent; a policy has none, its file defines it completely."""
    if is_object(spec):
        return _alone(spec).parameters(spec)
    return AGENTS.parameters(spec) if policy_file(spec) is None else []


def _own_agent(name: str, params: Mapping[str, Any]) -> Agent:
    """The agent that an object of the user's is or builds."""
    made = _alone(name).make(name, params)
    if not isinstance(made, Agent):
        raise InputError(f"agent {name}: expected a cavsumo.Agent, got {type(made).__name__}")
    return made


def _alone(name: str) -> Registry[Agent]:
    """A registry of one agent, the object of that name."""
    alone: Registry[Agent] = Registry("agent")
    alone.register(name)(factory_of(name, f"agent {name}"))
    return alone


class PolicyAgent(Agent):
    """A trained policy; it takes equal actions in equal situations, and does not learn."""

    sees_background = False

    def __init__(self, policy: TrainedPolicy) -> None:
        self.policy = policy
        self.drives = policy.header.kind not in WALKING

    def check_bodies(self, kind: Kind, bodies: int) -> None:
        header = self.policy.header
        if (header.kind, header.bodies) != (kind.name, bodies):
            raise ValueError(
                f"trained for {header.bodies} {header.kind} a team, this has {bodies} {kind.name} "
                f"(--kind, --bodies-per-agent)"
            )

    def reset(self, scene: Scene, owned: Sequence[int], rng: np.random.Generator) -> None:
        super().reset(scene, owned, rng)
        self._observer = TeamObserver(scene, owned)
        self._ways = [across(scene, i) for i in owned]
        self._left = 0  # timesteps that the decision still holds

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        if self._left == 0:
            self._left = self.policy.header.hold
            self._decide(snapshot)
        self._left -= 1
        if self.policy.header.actions == "targets":
            return tuple(
                towards(state, way, target, self.scene.dt)
                for state, way, target in zip(
                    self.own(snapshot), self._ways, self._targets, strict=True
                )
            )
        return self._actions

    def _decide(self, snapshot: Snapshot) -> None:
        """Ask the policy."""
        observation = self._observer.vector(snapshot)
        if self.policy.header.actions == "targets":
            self._targets = self.policy.targets(observation)
            return
        efforts = self.policy.efforts(observation)
        self._actions = tuple(
            effort(state.body.kind, *pair)
            for state, pair in zip(self.own(snapshot), efforts, strict=True)
        )


def effort(kind: Kind, throttle: float, steering: float) -> Action:
    """The action at shares of the effectors' ranges: -1 is the lower limit, 1 the upper one."""
    low, high = kind.throttle_min, kind.throttle_max
    return Action(low + (throttle + 1.0) / 2.0 * (high - low), steering * kind.steering_max)
