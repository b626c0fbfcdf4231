"""The agent whose tests are searched for: it plays the point of a space that a searcher chose.

The searcher works in the parent process (``batch.searching``) and sends starts and programmes as
what the agent remembers, so an episode is replayed without it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from cavsumo.agents.base import AGENTS, Agent
from cavsumo.agents.decisions import DecidedWalk, Decision, Decisions, written
from cavsumo.agents.names import SEARCH, SEARCH_METHODS
from cavsumo.agents.programme import ProgrammedWalk, WalkProgramme
from cavsumo.agents.recorded import start_of
from cavsumo.errors import UnknownName
from cavsumo.model.bodies import Action
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

Programme = WalkProgramme | Decisions


@AGENTS.register(SEARCH)
class SearchAgent(Agent):
    """Searches for preventable failures: every episode is a point of a space of tests."""

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "method": f"how points are chosen: {', '.join(SEARCH_METHODS)} (docs/search.md)",
        "earlier": "results of an earlier search of the same space, whose best points come first",
    }
    FILES = ("earlier",)
    sees_background = False
    drives = False
    searches = True

    def __init__(self, method: str = "portfolio", earlier: str = "") -> None:
        if method not in SEARCH_METHODS:
            raise UnknownName("method", method, SEARCH_METHODS, f"agent {SEARCH}")
        self.method, self.earlier = method, earlier
        self._programmes: list[Programme | None] = []

    def reset(self, scene: Scene, owned: Sequence[int], rng: np.random.Generator) -> None:
        super().reset(scene, owned, rng)
        programmes = self._programmes or [None] * len(owned)
        self._walks = [
            _walk(scene, i, programme) for i, programme in zip(owned, programmes, strict=True)
        ]

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        return tuple(
            walk.action(snapshot, state)
            for walk, state in zip(self._walks, self.own(snapshot), strict=True)
        )

    def recall(self) -> Any:
        return {
            "starts": self.recorded_starts,
            "programmes": [one and list(one) for one in self._programmes],
        }

    def notes(self) -> str:
        """The situations in which its first body decided; empty where it follows a programme."""
        first = self._walks[0]
        return written(first.situations) if isinstance(first, DecidedWalk) else ""

    def remember(self, memory: Mapping[str, Any]) -> None:
        self.recorded_starts = [start_of(start) for start in memory["starts"]]
        self._programmes = [one and _programme(one) for one in memory["programmes"]]


def _programme(plain: Sequence[Any]) -> Programme:
    """A programme from a list of its fields; that of decisions has but two."""
    if len(plain) == len(Decisions._fields):
        arrival, chosen = plain
        return Decisions(arrival, [Decision(*one) for one in chosen])
    return WalkProgramme(*plain)


def _walk(scene: Scene, index: int, programme: Programme | None) -> ProgrammedWalk | DecidedWalk:
    """The walk of one body."""
    if isinstance(programme, Decisions):
        return DecidedWalk(scene, index, programme)
    return ProgrammedWalk(scene, index, programme)
