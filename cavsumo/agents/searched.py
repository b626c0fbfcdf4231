"""The agent whose tests are searched for: it plays the point of a space that a searcher chose.

The searcher works in the parent process (``batch.searching``) and sends starts and programmes as
what the agent remembers, so an episode is replayed without it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from cavsumo.agents.base import AGENTS, Agent
from cavsumo.agents.names import SEARCH, SEARCH_METHODS
from cavsumo.agents.programme import ProgrammedWalk, WalkProgramme
from cavsumo.agents.recorded import start_of
from cavsumo.agents.walking import throttle_to
from cavsumo.model.bodies import Action
from cavsumo.model.checks import choice, truth
from cavsumo.model.left_behind import LeftBehind
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot


@AGENTS.register(SEARCH)
class SearchAgent(Agent):
    """Searches for preventable failures: every episode is a point of a space of tests."""

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "method": f"how points are chosen: {', '.join(SEARCH_METHODS)} (docs/search.md)",
        "cut": "end an episode once the ego has left all bodies behind; false to play on",
    }
    sees_background = False
    drives = False
    searches = True

    def __init__(self, method: str = "portfolio", cut: bool = True) -> None:
        self.method = choice("method", method, SEARCH_METHODS)
        self.cut = truth("cut", cut)
        self._programmes: list[WalkProgramme | None] = []
        self._fellows: Sequence[SearchAgent] = ()

    def reset(self, scene: Scene, owned: Sequence[int], rng: np.random.Generator) -> None:
        super().reset(scene, owned, rng)
        programmes = self._programmes or [None] * len(owned)
        self._walks = [
            ProgrammedWalk(scene, i, programme)
            for i, programme in zip(owned, programmes, strict=True)
        ]
        self._behind, self._resting = LeftBehind(scene), False

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        states, dt = self.own(snapshot), self.scene.dt
        self._resting = self._resting or (self.cut and self._left_behind(snapshot))
        if self._resting:
            return tuple(Action(throttle_to(state, 0.0, dt), 0.0) for state in states)
        return tuple(
            walk.action(snapshot, state) for walk, state in zip(self._walks, states, strict=True)
        )

    def rests(self) -> bool:
        return self._resting

    def _left_behind(self, snapshot: Snapshot) -> bool:
        """Whether the ego has left behind all that any tester's programme still comes to."""
        walks = [walk for agent in self._fellows for walk in agent._walks]
        return snapshot.sees_ego and all(
            self._behind(snapshot, state, walk.reach(snapshot, state))
            for walk in walks
            if (state := snapshot.testers[walk.index])
        )

    @classmethod
    def coordinate(cls, agents: Sequence[Agent], rng: np.random.Generator) -> None:
        fellows = [agent for agent in agents if isinstance(agent, SearchAgent)]
        for agent in fellows:
            agent._fellows = fellows

    def recall(self) -> Any:
        return {
            "starts": self.recorded_starts,
            "programmes": [one and list(one) for one in self._programmes],
        }

    def remember(self, memory: Mapping[str, Any]) -> None:
        self.recorded_starts = [start_of(start) for start in memory["starts"]]
        self._programmes = [one and WalkProgramme(*one) for one in memory["programmes"]]
