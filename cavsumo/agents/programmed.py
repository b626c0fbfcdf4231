"""Algorithms 3 and 4 of the seed: a programmed behaviour, begun by chance or by a trigger.

The behaviour of a pedestrian is to cross the road. While it is inactive the bodies idle: they walk
along their pavement, go to the kerb and wait, or do nothing (the seed's noop). That of a vehicle
is a manoeuvre, before which it drives lawfully, or does nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from cavsumo.agents.base import AGENTS, Agent
from cavsumo.agents.behaviours import behaviour
from cavsumo.agents.manoeuvres import MANOEUVRES
from cavsumo.agents.random import EPSILON_DOC, RATE_DOC, Exploration
from cavsumo.agents.triggers import Proximity, Trigger
from cavsumo.model.bodies import Action
from cavsumo.model.checks import choice, number
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

IDLE_DOC = (
    "before crossing: walk along the 'pavement', wait at the 'kerb', or 'noop'; vehicles drive "
    "lawfully, or 'noop'"
)
MANOEUVRE_DOC = (
    "of vehicles: 'run' across the ego's way, 'brake' ahead of it, 'cut-in' from the lane beside; "
    "'auto' by where they start"
)


class ProgrammedAgent(Agent):
    """Begins its behaviour when ``starts`` says so; the frame of Algorithms 3 to 5."""

    sees_background = False

    def __init__(self, idle: str, manoeuvre: str = "auto") -> None:
        self.idle = choice("idle", idle, ("pavement", "kerb", "noop"))
        self.manoeuvre = choice("manoeuvre", manoeuvre, MANOEUVRES)

    def reset(self, scene: Scene, owned: Sequence[int], rng: np.random.Generator) -> None:
        super().reset(scene, owned, rng)
        self.behaviours = [behaviour(scene, i, self.idle, self.manoeuvre) for i in owned]

    def starts(self, i: int, snapshot: Snapshot, state: BodyState) -> bool:
        """Whether the behaviour of the i-th owned body begins now."""
        raise NotImplementedError

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        testers = snapshot.testers
        return tuple([self._choose(i, snapshot, testers[j]) for i, j in enumerate(self.owned)])

    def _choose(self, i: int, snapshot: Snapshot, state: BodyState) -> Action:
        programmed = self.behaviours[i]
        active = programmed.active
        if active and programmed.over(state):
            programmed.end()  # and the trigger may hold at once, as in the listing
            active = programmed.active
        if active or (self.starts(i, snapshot, state) and programmed.begin(state)):
            return programmed.act(snapshot, state)
        return programmed.idle(snapshot, state)


@AGENTS.register("programmed-random")
class ProgrammedRandomAgent(ProgrammedAgent):
    """Algorithm 3: with probability epsilon cross the road (CAV-Gym's constrained random)."""

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "rate_per_s": RATE_DOC,
        "epsilon": EPSILON_DOC,
        "idle": IDLE_DOC,
        "manoeuvre": MANOEUVRE_DOC,
    }

    def __init__(
        self,
        rate_per_s: float = 0.6,
        epsilon: float | None = None,
        idle: str = "pavement",
        manoeuvre: str = "auto",
    ) -> None:
        super().__init__(idle, manoeuvre)
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
        return self.triggers[i](snapshot, state) and snapshot.sees_ego


@AGENTS.register("proximity")
class ProximityAgent(ProgrammedReactiveAgent):
    """Algorithm 4, triggered by distance: cross when the ego is near (CAV-Gym's proximity)."""

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "distance_m": "trigger: distance between the centres of body and ego [m]",
        "idle": IDLE_DOC,
        "manoeuvre": MANOEUVRE_DOC,
    }

    def __init__(
        self, distance_m: float = 34.0, idle: str = "pavement", manoeuvre: str = "auto"
    ) -> None:
        super().__init__(idle, manoeuvre)
        self.distance_m = number("distance_m", distance_m, 0.0)

    def trigger(self, scene: Scene, index: int) -> Trigger:
        return Proximity(self.distance_m)


@AGENTS.register("timing")
class TimingAgent(ProgrammedReactiveAgent):
    """Algorithm 4, triggered by time: step in as the ego's reaction zone arrives (the default)."""

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "aim": "part of the reaction zone to step into, [0.3..1]: 1 its far end, 0 its near end",
        "idle": IDLE_DOC,
        "manoeuvre": MANOEUVRE_DOC,
    }

    def __init__(self, aim: float = 0.5, idle: str = "kerb", manoeuvre: str = "auto") -> None:
        super().__init__(idle, manoeuvre)
        self.aim = number("aim", aim, 0.3, 1.0)

    def trigger(self, scene: Scene, index: int) -> Trigger:
        return self.behaviours[self.owned.index(index)].timing(self.aim)
