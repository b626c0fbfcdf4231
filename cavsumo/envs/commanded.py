"""Agents and egos whose actions are set by the caller of an environment."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from cavsumo.agents.base import Agent
from cavsumo.agents.features import across, towards
from cavsumo.agents.policy import effort
from cavsumo.egos.base import EGO_KIND, Acceleration, Command, Drive, Ego
from cavsumo.errors import InputError
from cavsumo.model.bodies import Action
from cavsumo.model.checks import choice, number
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

CONTROLS = ("acceleration", "drive")
ACTIONS = ("effectors", "targets")


class CommandedAgent(Agent):
    """A tester agent whose action is set before it chooses.

    Args:
        actions: "effectors": throttle and steering of each body in [-1, 1]; "targets": for each
            body one of ``agents.features.TARGETS``, to which it walks until another is set.
        sees_background: whether snapshots must contain the whole background.

    Attributes:
        told: the action that was set, as numbers (``spaces``).
    """

    def __init__(self, actions: str, *, sees_background: bool) -> None:
        self.sees_background = sees_background
        self._aims = actions == "targets"
        self.told: Sequence[float] = ()

    def reset(self, scene: Scene, owned: Sequence[int], rng: np.random.Generator) -> None:
        super().reset(scene, owned, rng)
        self._ways = [across(scene, i) for i in owned] if self._aims else []

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        told, own = self.told, self.own(snapshot)
        if self._aims:
            return tuple(
                towards(state, way, int(target), self.scene.dt)
                for state, way, target in zip(own, self._ways, told, strict=True)
            )
        return tuple(
            effort(state.body.kind, throttle, steering)
            for state, throttle, steering in zip(own, told[::2], told[1::2], strict=True)
        )


class CommandedEgo(Ego):
    """An ego whose action is set before it acts.

    Args:
        control: "acceleration": SUMO keeps it on its route; "drive": throttle and steering.
        max_speed: it drives no faster [m/s].
        depart_speed: its first speed [m/s]; None for the largest that SUMO considers safe.

    Attributes:
        steers: whether it steers itself.
        told: the action that was set: throttle, and steering if it steers, each in [-1, 1].
    """

    def __init__(
        self,
        control: str = "acceleration",
        max_speed: float = 50 / 3.6,
        depart_speed: float | None = None,
    ) -> None:
        try:
            self.steers = choice("control", control, CONTROLS) == "drive"
            top = number("max_speed", max_speed, 0.1, EGO_KIND.v_max)
            if depart_speed is not None:
                depart_speed = number("depart_speed", depart_speed, 0.0, top)
        except ValueError as error:
            raise InputError(f"the learning ego: {error}") from error
        self.kind = dataclasses.replace(EGO_KIND, v_max=top)
        self.depart_speed = depart_speed
        self.told: Sequence[float] = ()

    def vtype(self) -> dict[str, str]:
        return super().vtype() | {"maxSpeed": f"{self.kind.v_max}"}

    def act(self, snapshot: Snapshot) -> Command:
        if self.steers:
            return Drive(*effort(self.kind, *self.told))
        return Acceleration(effort(self.kind, self.told[0], 0.0).throttle)
