"""The constant part of an episode, which agents and the ego receive at its beginning."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import shapely

from cavsumo.model.bodies import Body
from cavsumo.model.carriageway import Crossing, Light, Limit, MarkedCrossing, Roads, Start
from cavsumo.model.polyline import Path, Projection
from cavsumo.model.scenario.script import ScriptedTest
from cavsumo.model.snapshot import Snapshot
from cavsumo.model.surroundings import Surroundings


@dataclass(frozen=True)
class Scene:
    """The constant part of an episode.

    Attributes:
        dt: length of a timestep, the seed's lambda [s].
        ego: the vehicle under test.
        ego_path: the planned path of the ego.
        bodies: the testers' bodies, in the order of ``Snapshot.testers``.
        starts: where each of them starts.
        roads: carriageways and the ways across them; None for an open plane.
        lights: the traffic lights on the ego's path, in the order in which it meets them.
        crossings: the marked pedestrian crossings on the ego's path, likewise.
        limits: the speed limits on the ego's path, likewise.
        ground: the areas for walking or driving near the ego's path; None if unknown.
        surroundings: the lanes and pavements near the ego's path.
        horizon: longest duration of the episode [s]; infinite if not limited.
        seed: of the episode, for code that draws random numbers without a given generator.
        script: of the programmed testers and of the ego's approach; None without.
    """

    dt: float
    ego: Body
    ego_path: Path
    bodies: tuple[Body, ...]
    starts: tuple[Start, ...]
    roads: Roads | None = None
    lights: tuple[Light, ...] = ()
    seed: int = 0
    crossings: tuple[MarkedCrossing, ...] = ()
    limits: tuple[Limit, ...] = ()
    horizon: float = math.inf
    script: ScriptedTest | None = None
    ground: shapely.Geometry | None = field(default=None, repr=False)
    surroundings: Surroundings = field(default_factory=Surroundings, repr=False)
    _progress: list[Any] = field(default_factory=lambda: [None, None], repr=False)
    _glimpse: list[Any] = field(default_factory=lambda: [None, None], repr=False)
    _ways: dict[int, Crossing | None] = field(default_factory=dict, repr=False)

    @property
    def approach_speed(self) -> float | None:
        """The speed at which the ego is to approach [m/s]; None leaves it to the ego."""
        return None if self.script is None else self.script.ego.speed_mps

    def way(self, index: int) -> Crossing | None:
        """The way across the road from where a body starts; computed once."""
        if index not in self._ways:
            start = self.starts[index]
            self._ways[index] = self.roads.crossing(start.x, start.y) if self.roads else None
        return self._ways[index]

    def ego_progress(self, snapshot: Snapshot) -> float:
        """Arc length of the ego's centre on its path [m]; computed once for each snapshot."""
        return self.ego_projection(snapshot).along

    def ego_projection(self, snapshot: Snapshot) -> Projection:
        """Position of the ego's centre relative to its path; computed once for each snapshot."""
        if snapshot.unseen is not None:
            return self._glimpsed(snapshot)
        last, here = self._progress
        if last is not snapshot:
            if last is None or last.ego is not snapshot.ego:
                # The last segment is a hint only as long as the ego is not out of sight in between.
                followed = here is not None and snapshot.step - last.step == 1
                near = here.segment if followed else None
                here = self.ego_path.project(snapshot.ego.x, snapshot.ego.y, near)
            self._progress[:] = snapshot, here
        found: Projection = here
        return found

    def _glimpsed(self, snapshot: Snapshot) -> Projection:
        """The projection in a sensor's view: the ego may jump between views, so no hint is used."""
        if self._glimpse[0] is not snapshot:
            ego = snapshot.ego
            self._glimpse[:] = snapshot, self.ego_path.project(ego.x, ego.y)
        found: Projection = self._glimpse[1]
        return found
