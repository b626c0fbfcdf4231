"""Relative coordinates of a walking tester and the ego: four numbers, independent of the roads.

The ego follows its path and the body its way across; the two meet at one point.
"""

from __future__ import annotations

from typing import NamedTuple

from cavsumo.model.bodies import Kind, detour
from cavsumo.model.carriageway import Crossing
from cavsumo.model.kinematics import wrap
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot


class Meeting(NamedTuple):
    """The point where a body's way meets the ego's path.

    Attributes:
        way: the body's way.
        along: arc length of the point on the ego's path [m].
        strip: distance along its way at which the body's front touches the strip that the ego
            sweeps [m].
        width: further distance until its back has left the strip [m].
    """

    way: Crossing
    along: float
    strip: float
    width: float


def meeting(scene: Scene, index: int) -> Meeting | None:
    """The meeting of a body's way with the ego's path; None without a way or a meeting."""
    way, start, kind = scene.way(index), scene.starts[index], scene.bodies[index].kind
    met = scene.ego_path.meet(start.x, start.y, way.heading) if way else None
    if way is None or met is None:
        return None
    width = scene.ego.kind.width + kind.length
    return Meeting(way, met[1], met[0] - width / 2, width)


class Relative(NamedTuple):
    """A body against the ego.

    Attributes:
        gap: distance along the ego's path from its front to the near side of the body at the
            meeting point, negative once the front is beyond that [m].
        left: distance that the body has to walk until its front touches the strip that the ego
            sweeps, with the detour of the turn; negative within the strip and beyond it [m].
        v: speed of the ego [m/s].
        walk: speed of the body, in any direction [m/s].
        turn: turn that it needs to walk along its way, in (-pi, pi] [rad].
    """

    gap: float
    left: float
    v: float
    walk: float
    turn: float


class Coordinates:
    """Maps snapshots to one body's relative state.

    Attributes:
        meeting: the meeting of its way with the ego's path; without one (None) it has no relative
            state.
        kind: of the body.
    """

    def __init__(self, scene: Scene, index: int) -> None:
        self.scene, self.index = scene, index
        self.kind: Kind = scene.bodies[index].kind
        self.meeting = meeting(scene, index)
        self._front = scene.ego.kind.length / 2 + self.kind.width / 2

    def __call__(self, snapshot: Snapshot) -> Relative | None:
        """The relative state now; uses the projection on the ego's path that all bodies share."""
        if self.meeting is None:
            return None
        state = snapshot.testers[self.index]
        gap = self.meeting.along - self._front - self.scene.ego_progress(snapshot)
        return Relative(gap, self.left(state), snapshot.ego.v, state.v, self._turn(state))

    def left(self, state: BodyState) -> float:
        """The distance that the body has to walk to the ego's strip (``Relative.left``) [m]."""
        assert self.meeting is not None
        way = self.meeting.way
        left = self.meeting.strip - way.progress(state.x, state.y)
        return left + detour(self.kind, state.o, way.heading) if left > 0.0 else left

    def _turn(self, state: BodyState) -> float:
        assert self.meeting is not None
        return wrap(self.meeting.way.heading - state.o)
