"""When the ego has left a body behind for good: on the straight road, and where its path turns."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import pytest

from cavsumo.model.left_behind import CLEAR_M, LeftBehind
from cavsumo.model.polyline import Path

X, PAVEMENT_Y = 60.0, -5.0  # of the body


@pytest.fixture
def behind(straight_scene: Callable[..., Any], scene_snapshot: Callable[..., Any]) -> Any:
    """Call with the ego's x, or its state, and perhaps another path: whether the body is behind."""
    scene = straight_scene()

    def asked(ego: Any, path: Path | None = None) -> bool:
        here = scene if path is None else dataclasses.replace(scene, ego_path=path)
        snapshot = scene_snapshot(here, (ego, 8.0) if isinstance(ego, float) else ego)
        return LeftBehind(here)(snapshot, snapshot.testers[0])

    return asked


def test_a_body_is_behind_once_the_bumper_is_clear_of_it(
    behind: Any, straight_scene: Callable[..., Any]
) -> None:
    """Half of the ego, the body, the clearance; further by the slant for a body at the side."""
    scene = straight_scene()
    room = scene.ego.kind.length / 2 + scene.bodies[0].kind.reach + CLEAR_M
    room += math.tan(math.radians(15.0)) * abs(PAVEMENT_Y + 1.825)
    assert not behind(X - 20.0)
    assert not behind(X)
    assert not behind(X + room - 0.2)
    assert behind(X + room + 0.2)


def test_a_body_at_which_the_path_comes_back_is_not_behind(behind: Any) -> None:
    """The ego turns round at the end of the street."""
    back = Path([(0.0, -1.825), (90.0, -1.825), (90.0, 1.825), (0.0, 1.825)])
    assert not behind(X + 20.0, back)
    assert not behind((70.0, 1.825, 8.0, math.pi), back)
    assert behind((30.0, 1.825, 8.0, math.pi), back)


def test_a_body_beside_a_turn_is_behind_when_the_turn_is_over(behind: Any) -> None:
    """The ego turns left at x = 80: the body, west of it, is abreast for a while."""
    north = Path([(0.0, -1.825), (80.0, -1.825), (80.0, 60.0)])
    assert not behind(X + 18.0, north)
    assert not behind((80.0, 2.0, 8.0, math.pi / 2), north)
    assert behind((80.0, 20.0, 8.0, math.pi / 2), north)
