"""From where the tester of an episode came, and how fast: the features by which tests are alike."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from cavsumo.agents.planning.coordinates import meeting
from cavsumo.assertions.contacts import STANDING_MPS
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

LEFT, RIGHT, AHEAD = "left", "right", "ahead"
BESIDE_M = 1.5  # a vehicle that starts nearer to the ego's path starts ahead


class TesterCourse(NamedTuple):
    """The course of one tester.

    Attributes:
        meets: where its way meets the ego's path; of a vehicle, where it starts beside it [m].
        side: of the ego's path from which it comes.
        speed: its mean speed while it moved on the road [m/s]; None if it did not.
    """

    meets: float
    side: str
    speed: float | None


def tester_course(scene: Scene, history: Sequence[Snapshot], name: str) -> TesterCourse | None:
    """The course of the tester of a name, else of that which came nearest; None without testers."""
    index = next((i for i, body in enumerate(scene.bodies) if body.id == name), None)
    if index is None:
        index = _nearest(history)
    if index is None:
        return None
    start, way, met = scene.starts[index], scene.way(index), meeting(scene, index)
    states = [snapshot.testers[index] for snapshot in history]
    if way is None or met is None:
        here = scene.ego_path.project(start.x, start.y)
        side = AHEAD if abs(here.lateral) < BESIDE_M else LEFT if here.lateral > 0.0 else RIGHT
        return TesterCourse(here.along, side, _mean([s.v for s in states]))
    left = math.sin(scene.ego_path.at(met.along)[2] - way.heading) > 0.0
    on_road = [s.v for s in states if way.enter < way.progress(s.x, s.y) < way.leave]
    return TesterCourse(met.along, LEFT if left else RIGHT, _mean(on_road))


def _nearest(history: Sequence[Snapshot]) -> int | None:
    """The index of the tester that came nearest to the ego."""
    apart = [
        (math.hypot(tester.x - snapshot.ego.x, tester.y - snapshot.ego.y), i)
        for snapshot in history
        for i, tester in enumerate(snapshot.testers)
    ]
    return min(apart)[1] if apart else None


def _mean(speeds: Sequence[float]) -> float | None:
    """The mean of those that are a motion."""
    moving = [v for v in speeds if v > STANDING_MPS]
    return math.fsum(moving) / len(moving) if moving else None
