"""Algorithm 2 of the seed: now and then a random action, else none."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from cavsumo.agents.base import AGENTS, Agent
from cavsumo.agents.staying import Staying
from cavsumo.model.bodies import NOOP, Action, Kind
from cavsumo.model.checks import choice, number
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

RATE_DOC = "exploration rate [1/s]; epsilon = 1 - exp(-rate_per_s * timestep)"
EPSILON_DOC = "exploration rate per timestep [0..1], as in the seed; replaces rate_per_s"


class Exploration:
    """The seed's epsilon, given per second or per timestep."""

    def __init__(self, rate_per_s: float, epsilon: float | None) -> None:
        self.rate_per_s = number("rate_per_s", rate_per_s, 0.0)
        self.epsilon = None if epsilon is None else number("epsilon", epsilon, 0.0, 1.0)

    def per_step(self, dt: float) -> float:
        """The probability of exploring in one timestep of dt seconds."""
        if self.epsilon is not None:
            return self.epsilon
        return -math.expm1(-self.rate_per_s * dt)


@AGENTS.register("random")
class RandomAgent(Agent):
    """Algorithm 2: with probability epsilon a random action, else none."""

    sees_background = False

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "rate_per_s": RATE_DOC,
        "epsilon": EPSILON_DOC,
        "between": "between two random actions 'noop' (the seed), or 'repeat' the last (CAV-Gym)",
    }

    def __init__(
        self, rate_per_s: float = 0.6, epsilon: float | None = None, between: str = "noop"
    ) -> None:
        self.exploration = Exploration(rate_per_s, epsilon)
        self.between = choice("between", between, ("repeat", "noop"))

    def reset(self, scene: Scene, owned: Sequence[int], rng: np.random.Generator) -> None:
        super().reset(scene, owned, rng)
        self._epsilon = self.exploration.per_step(scene.dt)
        self._last = [NOOP for _ in owned]
        self._staying = [Staying(scene, i) for i in owned]

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        states = self.own(snapshot)
        for i, state in enumerate(states):
            if self.rng.random() < self._epsilon:
                self._last[i] = random_action(state.body.kind, self.rng)
            elif self.between == "noop":
                self._last[i] = NOOP
        drawn = zip(self._staying, states, self._last, strict=True)
        return tuple(staying.action(state, action) for staying, state, action in drawn)


def random_action(kind: Kind, rng: np.random.Generator) -> Action:
    """A uniform choice from A(s), the product of the two effectors' intervals."""
    return Action(
        float(rng.uniform(kind.throttle_min, kind.throttle_max)),
        float(rng.uniform(-kind.steering_max, kind.steering_max)),
    )
