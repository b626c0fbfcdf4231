"""The agent whose tests are searched for: it plays the point of a space that a searcher chose.

The searcher works in the parent process (``batch.searching``) and sends starts and programmes as
what the agent remembers, so an episode is replayed without it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from cavsumo.agents.base import AGENTS
from cavsumo.agents.decisions import DecidedWalk, Decision, Decisions, written
from cavsumo.agents.drive_programme import ProgrammedDrive
from cavsumo.agents.names import SEARCH, SEARCH_METHODS
from cavsumo.agents.programme import ProgrammedWalk, WalkProgramme
from cavsumo.agents.programmed_manoeuvres import DriveProgramme
from cavsumo.agents.recorded import start_of
from cavsumo.agents.resting import Programmed, RestingAgent
from cavsumo.errors import UnknownName
from cavsumo.model.checks import truth
from cavsumo.model.scene import Scene

Programme = WalkProgramme | DriveProgramme


@AGENTS.register(SEARCH)
class SearchAgent(RestingAgent):
    """Searches for preventable failures: every episode is a point of a space of tests."""

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "method": f"how points are chosen: {', '.join(SEARCH_METHODS)} (docs/search.md)",
        "cut": "end an episode once the ego has left all bodies behind; false to play on",
        "within": "bounds of the space, such as speed=0.3:0.8,side=left (docs/search.md)",
        "earlier": "results of an earlier search of the same space, whose best points come first",
    }
    FILES = ("earlier",)

    def __init__(
        self, method: str = "portfolio", cut: bool = True, within: str = "", earlier: str = ""
    ) -> None:
        if method not in SEARCH_METHODS:
            raise UnknownName("method", method, SEARCH_METHODS, f"agent {SEARCH}")
        self.method, self.within, self.earlier = method, within, earlier
        self.cut = truth("cut", cut)
        self._programmes: list[Programme | Decisions | None] = []

    def _programmes_of(self, scene: Scene, owned: Sequence[int]) -> list[Programmed]:
        programmes = self._programmes or [None] * len(owned)
        return [
            _programmed(scene, i, programme) for i, programme in zip(owned, programmes, strict=True)
        ]

    def recall(self) -> Any:
        return {
            "starts": self.recorded_starts,
            "programmes": [one and one._asdict() for one in self._programmes],
        }

    def notes(self) -> str:
        """The situations in which its first body decided; empty where it follows a programme."""
        first = self._programmed[0]
        return written(first.situations) if isinstance(first, DecidedWalk) else ""

    def remember(self, memory: Mapping[str, Any]) -> None:
        self.recorded_starts = [start_of(start) for start in memory["starts"]]
        self._programmes = [one and _told(one) for one in memory["programmes"]]


def _programmed(
    scene: Scene, index: int, programme: Programme | Decisions | None
) -> ProgrammedWalk | DecidedWalk | ProgrammedDrive:
    """A body that follows a programme or its decisions; None: it stands by."""
    if isinstance(programme, Decisions):
        return DecidedWalk(scene, index, programme)
    if scene.starts[index].approach is None:
        assert not isinstance(programme, DriveProgramme)
        return ProgrammedWalk(scene, index, programme)
    assert not isinstance(programme, WalkProgramme)
    return ProgrammedDrive(scene, index, programme)


def _told(plain: Mapping[str, Any]) -> Programme | Decisions:
    """A programme or decisions from their fields; raises TypeError for others."""
    if "chosen" in plain:
        return Decisions(plain["arrival"], [Decision(*one) for one in plain["chosen"]])
    return programme_of(plain)


def programme_of(plain: Mapping[str, Any]) -> Programme:
    """A programme from its fields; raises TypeError for others."""
    made = DriveProgramme if "effort" in plain else WalkProgramme
    return made(**plain)
