"""From where a tester came and how fast, on the straight road."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import pytest

from cavsumo.model.bodies import CAR
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot
from cavsumo.simulation.courses import BodyCourse, course_of

SceneOf = Callable[..., Scene]
SnapshotOf = Callable[..., Snapshot]


@pytest.mark.parametrize(("y", "side"), [(-5.15, "right"), (5.15, "left")])
def test_a_pedestrian_comes_from_a_side(
    straight_scene: SceneOf, scene_snapshot: SnapshotOf, y: float, side: str
) -> None:
    """Only its speed on the road counts, and only while it moves."""
    scene = straight_scene([(60.0, y, 0.0)])
    inward = -math.copysign(math.pi / 2, y)
    walked = [(4.5, 1.4), (3.0, 0.8), (2.0, 0.4), (2.0, 0.0)]
    history = [
        scene_snapshot(scene, testers=[(60.0, math.copysign(far, y), v, inward)])
        for far, v in walked
    ]
    assert course_of(scene, history, "tester0") == BodyCourse(
        pytest.approx(60.0), side, pytest.approx(0.6)
    )


def test_without_a_name_it_is_the_nearest(
    straight_scene: SceneOf, scene_snapshot: SnapshotOf
) -> None:
    """One that never came onto the road has no speed there."""
    scene = straight_scene([(90.0, 5.15, 0.0), (20.0, -5.15, 0.0)])
    found = course_of(scene, [scene_snapshot(scene)], "")
    assert found == BodyCourse(pytest.approx(20.0), "right", None)
    alone = dataclasses.replace(scene, bodies=(), starts=())
    assert course_of(alone, [scene_snapshot(alone, testers=[])], "") is None


def test_a_vehicle_ahead_comes_from_ahead(
    straight_scene: SceneOf, scene_snapshot: SnapshotOf
) -> None:
    """It starts in the ego's lane, and has no way across."""
    scene = straight_scene([(40.0, -1.825, 0.0)], kind=CAR, open_plane=True)
    history = [scene_snapshot(scene, testers=[(40.0, -1.825, v, 0.0)]) for v in (4.0, 8.0)]
    assert course_of(scene, history, "tester0") == BodyCourse(40.0, "ahead", 6.0)
