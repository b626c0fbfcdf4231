"""An agent whose bodies follow programmes, and rest once the ego has left them all behind."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from cavsumo.agents.base import Agent
from cavsumo.agents.walking import throttle_to
from cavsumo.model.bodies import Action
from cavsumo.model.left_behind import LeftBehind
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot


class Programmed(Protocol):
    """One body that follows a programme, in one episode."""

    index: int

    def action(self, snapshot: Snapshot, state: BodyState) -> Action:
        """The next action."""

    def reach(self, snapshot: Snapshot, state: BodyState) -> float:
        """How far the body may come from where it is, detours around others apart [m]."""


class RestingAgent(Agent):
    """Moves each of its bodies by a programme of its own.

    Where the ego has left behind all that the programmes of any of these agents still come to,
    their bodies stop, and the episode may end early; with ``cut`` false they play on.
    """

    cut = True
    sees_background = False
    searches = True

    def reset(self, scene: Scene, owned: Sequence[int], rng: np.random.Generator) -> None:
        super().reset(scene, owned, rng)
        self._programmed = self._programmes_of(scene, owned)
        self._fellows: Sequence[RestingAgent] = (self,)
        self._behind, self._resting = LeftBehind(scene), False

    def _programmes_of(self, scene: Scene, owned: Sequence[int]) -> list[Programmed]:
        """The bodies of one episode, as many as it owns."""
        raise NotImplementedError

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        states, dt = self.own(snapshot), self.scene.dt
        self._resting = self._resting or (self.cut and self._left_behind(snapshot))
        if self._resting:
            return tuple(Action(throttle_to(state, 0.0, dt), 0.0) for state in states)
        return tuple(
            one.action(snapshot, state) for one, state in zip(self._programmed, states, strict=True)
        )

    def rests(self) -> bool:
        return self._resting

    def _left_behind(self, snapshot: Snapshot) -> bool:
        """Whether the ego has left behind all that any tester's programme still comes to."""
        programmed = [one for agent in self._fellows for one in agent._programmed]
        return snapshot.sees_ego and all(
            self._behind(snapshot, state, one.reach(snapshot, state))
            for one in programmed
            if (state := snapshot.testers[one.index])
        )

    @classmethod
    def coordinate(cls, agents: Sequence[Agent], rng: np.random.Generator) -> None:
        fellows = [agent for agent in agents if isinstance(agent, RestingAgent)]
        for agent in fellows:
            agent._fellows = fellows
