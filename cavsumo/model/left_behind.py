"""Whether the ego has left a body behind for good, by the geometry of its path.

A body that comes no farther than some distance is left behind once all that it can reach lies
behind the ego's rear bumper, now and at every place that the ego still comes to. The ego may be
beside its path, in another lane, and at a slant to it, as it changes lanes; but it does not leave
its road or reverse.
"""

from __future__ import annotations

import math

from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

CLEAR_M = 2.0  # behind the bumper
SLANT = math.tan(math.radians(15.0))  # of an ego that changes lanes, against its path
STEP_M = 1.0  # along the path


class LeftBehind:
    """Knows for the bodies of one episode whether the ego has left them behind."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._ahead: dict[str, float] = {}  # where on the path a body was not behind last [m]

    def __call__(self, snapshot: Snapshot, body: BodyState, reach: float = 0.0) -> bool:
        """Whether a body that comes no farther than ``reach`` [m] is left behind for good."""
        ego, scene, path = snapshot.ego, self._scene, self._scene.ego_path
        if not self._behind(body, reach, ego.x, ego.y, ego.o):
            return False
        here = scene.ego_progress(snapshot)
        known = self._ahead.get(body.id, -math.inf)
        if known > here and not self._behind(body, reach, *path.at(known)):
            return False
        for i in range(math.ceil((path.length - here) / STEP_M)):
            along = path.length - i * STEP_M
            if not self._behind(body, reach, *path.at(along)):
                self._ahead[body.id] = along
                return False
        return True

    def _behind(self, body: BodyState, reach: float, x: float, y: float, o: float) -> bool:
        """Whether all that a body can reach is behind the rear bumper of an ego in a pose."""
        dx, dy, c, s = body.x - x, body.y - y, math.cos(o), math.sin(o)
        room = self._scene.ego.kind.length / 2 + body.body.kind.reach + CLEAR_M
        room += (1.0 + SLANT) * reach
        return dx * c + dy * s + SLANT * abs(dy * c - dx * s) < -room
