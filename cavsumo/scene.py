"""What does not change during an episode: everybody who decides is told at its beginning."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from cavsumo.bodies import Body
from cavsumo.paths import Path, Projection
from cavsumo.roads import Crossing, Light, Roads, Start
from cavsumo.snapshot import Snapshot


@dataclass(frozen=True)
class Scene:
    """What does not change during an episode.

    Attributes:
        dt: length of a timestep, the seed's lambda [s].
        ego: the vehicle under test.
        ego_path: where it means to drive.
        bodies: the testers' bodies, in the order of ``Snapshot.testers``.
        starts: where each of them starts.
        roads: carriageways and the ways across them; None on an open plane.
        lights: the traffic lights on the ego's path, in the order in which it meets them.
        seed: of the episode; whoever draws random numbers without a generator starts from it.
        ego_jumps: whether the ego may be anywhere in the next snapshot, as seen through a sensor.
    """

    dt: float
    ego: Body
    ego_path: Path
    bodies: tuple[Body, ...]
    starts: tuple[Start, ...]
    roads: Roads | None = None
    lights: tuple[Light, ...] = ()
    seed: int = 0
    ego_jumps: bool = False
    _progress: list[Any] = field(default_factory=lambda: [None, None], repr=False)
    _ways: dict[int, Crossing | None] = field(default_factory=dict, repr=False)

    def seen_apart(self, *, ego_jumps: bool) -> Scene:
        """The same scene for those who are shown snapshots of their own."""
        return replace(self, ego_jumps=ego_jumps, _progress=[None, None])

    def way(self, index: int) -> Crossing | None:
        """The way across the road from where a body starts; computed once."""
        if index not in self._ways:
            start = self.starts[index]
            self._ways[index] = self.roads.crossing(start.x, start.y) if self.roads else None
        return self._ways[index]

    def ego_progress(self, snapshot: Snapshot) -> float:
        """How far the ego's centre is along its path [m]; computed once for each snapshot."""
        return self.ego_projection(snapshot).along

    def ego_projection(self, snapshot: Snapshot) -> Projection:
        """Where the ego's centre is relative to its path; computed once for each snapshot."""
        last, here = self._progress
        if last is not snapshot:
            # The last segment is a hint only as long as the ego is not out of sight in between.
            followed = here is not None and snapshot.step - last.step == 1 and not self.ego_jumps
            near = here.segment if followed else None
            here = self.ego_path.project(snapshot.ego.x, snapshot.ego.y, near)
            self._progress[:] = snapshot, here
        found: Projection = here
        return found
