"""The agent whose bodies do what an exposure says: they arrive, look or not, and go or stay.

An estimator in the parent process (``batch.estimating``) chooses random vectors and sends what they
mean, so an episode is replayed without it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

from cavsumo.agents.base import AGENTS
from cavsumo.agents.exposed_drives import ExposedDrive, ExposedDriver
from cavsumo.agents.names import ESTIMATE_METHODS, EXPOSURE
from cavsumo.agents.programme import ROUND_M, ProgrammedWalk, WalkProgramme
from cavsumo.agents.programmed_manoeuvres import DriveProgramme
from cavsumo.agents.recorded import start_of
from cavsumo.agents.resting import Programmed, RestingAgent
from cavsumo.model.checks import choice, number, truth
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

GREEN = "gG"
CREEP_MPS = 1.0  # a slower ego counts as so fast


class ExposedPedestrian(NamedTuple):
    """A pedestrian of an exposure.

    Attributes:
        arrival_s: time that the ego has left, at its present speed, as it arrives at the kerb [s].
        accepts: whether it then steps off, where no light says otherwise.
        complies: whether it waits for a red light.
        programme: how it walks.
    """

    arrival_s: float
    accepts: bool
    complies: bool
    programme: WalkProgramme


class ExposedWalk(ProgrammedWalk):
    """One pedestrian of an exposure, in one episode; it decides once, as it arrives."""

    def __init__(self, scene: Scene, index: int, walker: ExposedPedestrian | None) -> None:
        super().__init__(scene, index, walker and walker.programme)
        self._walker, self._stays = walker, False
        self._light: int | None = None
        for i, crossing in enumerate(scene.crossings):
            inside = self._met and crossing.begin <= self._met.along <= crossing.end
            if inside and crossing.signalled:
                self._light = i

    def reach(self, snapshot: Snapshot, state: BodyState) -> float:
        """How far it may come [m]; somebody who stays never comes onto the road."""
        if self._stays:
            return ROUND_M + self._idle.left(state)
        return super().reach(snapshot, state)

    def _due(self, snapshot: Snapshot, state: BodyState, programme: WalkProgramme) -> bool:
        """Whether it arrives now and steps off."""
        walker = self._walker
        if walker is None or self._stays or not snapshot.sees_ego:
            return False
        left = self._gap(snapshot, 0.0) / max(CREEP_MPS, snapshot.ego.v)
        if left > walker.arrival_s:
            return False
        self._stays = not self._steps_off(snapshot, walker)
        return not self._stays

    def _steps_off(self, snapshot: Snapshot, walker: ExposedPedestrian) -> bool:
        """The decision at the kerb."""
        letters = snapshot.crossing_lights
        if self._light is None or self._light >= len(letters) or not letters[self._light]:
            return walker.accepts
        if letters[self._light] in GREEN:
            return True
        return walker.accepts and not walker.complies


@AGENTS.register(EXPOSURE)
class ExposureAgent(RestingAgent):
    """People who arrive and cross as an exposure says, to estimate how often the ego fails."""

    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "method": f"estimator: {', '.join(ESTIMATE_METHODS)} (docs/probability.md)",
        "exposure": "the exposure, a TOML file; empty for the default",
        "half_width": "relative half-width of the interval at which to end",
        "bound": "upper end of the interval at which to end; 0 for none",
        "cut": "end an episode once the ego has left all bodies behind; false to play on",
    }
    FILES: ClassVar[tuple[str, ...]] = ("exposure",)

    def __init__(
        self,
        method: str = "auto",
        exposure: str | Path = "",
        half_width: float = 0.3,
        bound: float = 0.0,
        cut: bool = True,
    ) -> None:
        self.method = choice("method", method, ESTIMATE_METHODS)
        self.exposure = str(exposure)
        self.half_width = number("half_width", half_width, 0.0)
        if self.half_width == 0.0:
            raise ValueError("half_width must be above 0, got 0")
        self.bound = number("bound", bound, 0.0, 1.0)
        self.cut = truth("cut", cut)
        self._walkers: list[ExposedPedestrian | None] = []
        self._drivers: list[ExposedDriver | None] = []

    def _programmes_of(self, scene: Scene, owned: Sequence[int]) -> list[Programmed]:
        nobody = [None] * len(owned)
        return [
            ExposedDrive(scene, i, driver)
            if scene.starts[i].approach
            else ExposedWalk(scene, i, walker)
            for i, walker, driver in zip(
                owned, self._walkers or nobody, self._drivers or nobody, strict=True
            )
        ]

    def recall(self) -> Any:
        memory = {"starts": self.recorded_starts, "walkers": _plain(self._walkers)}
        if self._drivers:
            memory = {"starts": self.recorded_starts, "drivers": _plain(self._drivers)}
        return memory

    def remember(self, memory: Mapping[str, Any]) -> None:
        self.recorded_starts = [start_of(start) for start in memory["starts"]]
        self._walkers = [
            one and ExposedPedestrian(**{**one, "programme": WalkProgramme(*one["programme"])})
            for one in memory.get("walkers", ())
        ]
        self._drivers = [
            one and ExposedDriver(**{**one, "programme": DriveProgramme(*one["programme"])})
            for one in memory.get("drivers", ())
        ]


def _plain(people: Sequence[ExposedPedestrian | ExposedDriver | None]) -> list[Any]:
    """People as plain data."""
    return [one and {**one._asdict(), "programme": [*one.programme]} for one in people]
