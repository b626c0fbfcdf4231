"""Algorithms 3 and 4 of the seed: a programmed behaviour, begun by chance or by a trigger.

The behaviour is to cross the road. While it is inactive the bodies idle: they walk along their
pavement, go to the kerb and wait, or do nothing (the seed's noop).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar, Protocol

import numpy as np

from cavsumo.agents.base import AGENTS, Agent
from cavsumo.agents.random import EPSILON_DOC, RATE_DOC, Exploration
from cavsumo.agents.triggers import Proximity, Timing, Trigger
from cavsumo.agents.walking import ApproachKerb, CrossingWalk, Stroll
from cavsumo.bodies import NOOP, Action
from cavsumo.checks import choice, number
from cavsumo.scene import Scene
from cavsumo.snapshot import BodyState, Snapshot

IDLE_DOC = "before crossing: walk along the 'pavement', wait at the 'kerb', or 'noop'"


class Idle(Protocol):
    """What a body does while its behaviour is inactive."""

    def action(self, state: BodyState) -> Action: ...


class DoNothing:
    """The seed's noop."""

    def action(self, state: BodyState) -> Action:
        return NOOP


def idling(name: str, scene: Scene, index: int) -> Idle:
    """The idle behaviour of that name for a body."""
    if name == "pavement":
        return Stroll(scene, index)
    if name == "kerb":
        return ApproachKerb(scene, index)
    return DoNothing()


class ProgrammedAgent(Agent):
    """Crosses the road when ``starts`` says so; the frame of Algorithms 3 to 5."""

    sees_background = False

    def __init__(self, idle: str) -> None:
        self.idle = choice("idle", idle, ("pavement", "kerb", "noop"))

    def reset(self, scene: Scene, owned: Sequence[int], rng: np.random.Generator) -> None:
        super().reset(scene, owned, rng)
        self.crossings = [CrossingWalk(scene) for _ in owned]
        self._idles = [idling(self.idle, scene, i) for i in owned]

    def starts(self, i: int, snapshot: Snapshot, state: BodyState) -> bool:
        """Whether the behaviour of the i-th owned body begins now."""
        raise NotImplementedError

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        testers = snapshot.testers
        return tuple([self._choose(i, snapshot, testers[j]) for i, j in enumerate(self.owned)])

    def _choose(self, i: int, snapshot: Snapshot, state: BodyState) -> Action:
        crossing = self.crossings[i]
        if crossing.crossing is None:
            if not (self.starts(i, snapshot, state) and crossing.begin(state)):
                return self._idles[i].action(state)
            self._idles[i] = DoNothing()  # beyond the road nothing of the start holds
        return crossing.action(state)


@AGENTS.register("programmed-random")
class ProgrammedRandomAgent(ProgrammedAgent):
    """Algorithm 3: with probability epsilon cross the road (CAV-Gym's constrained random)."""

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "rate_per_s": RATE_DOC,
        "epsilon": EPSILON_DOC,
        "idle": IDLE_DOC,
    }

    def __init__(
        self, rate_per_s: float = 0.6, epsilon: float | None = None, idle: str = "pavement"
    ) -> None:
        super().__init__(idle)
        self.exploration = Exploration(rate_per_s, epsilon)

    def starts(self, i: int, snapshot: Snapshot, state: BodyState) -> bool:
        return self.rng.random() < self.exploration.per_step(self.scene.dt)


class ProgrammedReactiveAgent(ProgrammedAgent):
    """Algorithm 4: cross the road when a trigger holds."""

    def trigger(self, scene: Scene, index: int) -> Trigger:
        """The trigger phi of one body."""
        raise NotImplementedError

    def reset(self, scene: Scene, owned: Sequence[int], rng: np.random.Generator) -> None:
        super().reset(scene, owned, rng)
        self.triggers = [self.trigger(scene, i) for i in owned]

    def starts(self, i: int, snapshot: Snapshot, state: BodyState) -> bool:
        return self.triggers[i](snapshot, state)


@AGENTS.register("proximity")
class ProximityAgent(ProgrammedReactiveAgent):
    """Algorithm 4, triggered by distance: cross when the ego is near (CAV-Gym's proximity)."""

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "distance_m": "trigger: distance between the centres of body and ego [m]",
        "idle": IDLE_DOC,
    }

    def __init__(self, distance_m: float = 34.0, idle: str = "pavement") -> None:
        super().__init__(idle)
        self.distance_m = number("distance_m", distance_m, 0.0)

    def trigger(self, scene: Scene, index: int) -> Trigger:
        return Proximity(self.distance_m)


@AGENTS.register("timing")
class TimingAgent(ProgrammedReactiveAgent):
    """Algorithm 4, triggered by time: step in as the ego's reaction zone arrives (the default)."""

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "aim": "part of the reaction zone to step into, [0.3..1]: 1 its far end, 0 its near end",
        "idle": IDLE_DOC,
    }

    def __init__(self, aim: float = 0.5, idle: str = "kerb") -> None:
        super().__init__(idle)
        self.aim = number("aim", aim, 0.3, 1.0)

    def trigger(self, scene: Scene, index: int) -> Trigger:
        return Timing(scene, index, self.aim)
