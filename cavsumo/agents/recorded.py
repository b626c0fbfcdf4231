"""Recorded actions, repeated independently of the present state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cavsumo.agents.base import AGENTS, Agent
from cavsumo.errors import NoSuchAction
from cavsumo.model.bodies import NOOP, Action, Kind
from cavsumo.model.kinematics import steering_for_turn, wrap
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

Joint = Sequence[tuple[float, float]]  # throttle and steering of each owned body


@AGENTS.register("recorded")
class RecordedAgent(Agent):
    """Repeats given actions (``certify --open-loop``), then does nothing.

    They are given as its knowledge: for each timestep the actions of its bodies.
    """

    sees_background = False

    def __init__(self) -> None:
        self._chosen: list[tuple[Action, ...]] = []

    def reset(self, scene: Scene, owned: Sequence[int], rng: np.random.Generator) -> None:
        super().reset(scene, owned, rng)
        self._next = iter(self._chosen)

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        return next(self._next, (NOOP,) * len(self.owned))

    def recall(self) -> Any:
        return self._chosen

    def remember(self, memory: Sequence[Joint]) -> None:
        self._chosen = [tuple(Action(*action) for action in joint) for joint in memory]


def action_between(
    kind: Kind, before: Sequence[float], after: Sequence[float], dt: float
) -> tuple[float, float]:
    """Throttle and steering that lead a body from one state (x, y, v, o) to the next (eqs 20-22).

    A speed at its limit comes from the effector at its limit, so that it is reproduced exactly; a
    turn below the rounding error is none.
    """
    _, _, v, o = before
    _, _, v_next, o_next = after
    throttle = (v_next - v) / dt
    if v_next <= kind.v_min:
        throttle = kind.throttle_min
    elif v_next >= kind.v_max:
        throttle = kind.throttle_max
    try:
        steering = steering_for_turn(v, wrap(o_next - o), kind.wheelbase, dt)
    except NoSuchAction:
        steering = 0.0
    return (
        max(kind.throttle_min, min(kind.throttle_max, throttle)),
        max(-kind.steering_max, min(kind.steering_max, steering)),
    )
