"""What a learning tester is shown: numbers computed by hand on the straight road, and bounds."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cavsumo.agents import AGENTS, Scene
from cavsumo.agents.observations import TeamObserver, entries
from cavsumo.egos.base import EGO_KIND
from cavsumo.model.bodies import PEDESTRIAN
from cavsumo.model.scenario import BatchPlan
from cavsumo.model.snapshot import Snapshot
from cavsumo.network.site import Site
from cavsumo.simulation.loop import EpisodeLoop
from cavsumo.simulation.setup import make_setup

Snapshots = Callable[..., Snapshot]
HALF_EGO, HALF_STRIP = EGO_KIND.length / 2, EGO_KIND.width / 2
DEEP, BROAD = PEDESTRIAN.length, PEDESTRIAN.width


def shown(scene: Scene, snapshot: Snapshot, team: tuple[int, ...] = (0,)) -> dict[str, float]:
    """The entries by their names."""
    observer = TeamObserver(scene, team)
    return dict(zip(observer.names, observer.vector(snapshot).tolist(), strict=True))


def test_a_pedestrian_at_the_kerb_is_seen_in_the_egos_coordinates(
    straight_scene: Callable[..., Scene], scene_snapshot: Snapshots
) -> None:
    """The ego at x = 10 m with 8 m/s, a walker at x = 30 m, 4 m beside its path, at 1.4 m/s."""
    y = -1.825 - 4.0
    scene = straight_scene([(30.0, y, math.pi / 2)])
    seen = shown(scene, scene_snapshot(scene, (10.0, 8.0), [(30.0, y, 1.4, math.pi / 2)]))
    ahead = 30.0 - BROAD / 2 - 10.0 - HALF_EGO
    strip = 4.0 - HALF_STRIP - DEEP / 2
    gap = ahead - 8.0 * (strip / 1.4 + 0.1)
    expected = {
        "ego.speed_mps": 8.0,
        "ego.steering_rad": 0.0,
        "ego.left_m": 99.0 - 10.0 - HALF_EGO,
        "body0.ahead_m": ahead,
        "body0.strip_m": strip,
        "body0.entry_s": strip / 1.4,
        "body0.timing": (gap - 8.0 * 8.0 / 18.0) / (0.675 * 8.0),
        "body0.speed_mps": 1.4,
        "body0.sin": 0.0,
        "body0.cos": 1.0,
        "body0.offset_m": 0.0,
        "body0.on_road": 0.0,
        "other.ahead_m": 100.0,
        "other.beside_m": 30.0,
        "other.speed_mps": 0.0,
    }
    assert seen == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_both_sides_of_the_road_look_alike(
    straight_scene: Callable[..., Scene], scene_snapshot: Snapshots, side: float
) -> None:
    """A walker 2 m beyond where it started, left of its way, on the road, turned to its left."""
    path = -1.825
    start = (30.0, path + side * 5.0, -side * math.pi / 2)
    left = 30.0 + side * 2.0  # who comes from the ego's left has its direction on the left
    scene = straight_scene([start])
    state = (left, path + side * 1.5, 1.0, -side * math.pi / 2 + 0.3)
    seen = shown(scene, scene_snapshot(scene, (10.0, 8.0), [state]))
    assert seen["body0.offset_m"] == pytest.approx(2.0)
    assert seen["body0.strip_m"] == pytest.approx(1.5 - HALF_STRIP - DEEP / 2, abs=1e-6)
    assert (seen["body0.sin"], seen["body0.cos"]) == pytest.approx((math.sin(0.3), math.cos(0.3)))
    assert seen["body0.on_road"] == 1.0


def test_beyond_the_strip_its_distance_is_negative(
    straight_scene: Callable[..., Scene], scene_snapshot: Snapshots
) -> None:
    """Having crossed the ego's path, a body is in it or beyond it, and need not walk there."""
    scene = straight_scene([(30.0, -5.0, math.pi / 2)])
    seen = shown(scene, scene_snapshot(scene, (10.0, 8.0), [(30.0, 1.175, 1.4, math.pi / 2)]))
    assert seen["body0.strip_m"] == pytest.approx(-3.0 - HALF_STRIP - DEEP / 2, abs=1e-6)
    assert seen["body0.entry_s"] == 0.0


def test_the_next_tester_of_another_team_is_shown(
    straight_scene: Callable[..., Scene], scene_snapshot: Snapshots
) -> None:
    """Of three others the nearest ahead of the ego: not the one behind it, not one of one's own."""
    xs = (40.0, 30.0, 35.0, 5.0, 60.0)
    scene = straight_scene([(x, -5.15, 0.0) for x in xs])
    states = [(x, -5.15, 0.1 * i, 0.0) for i, x in enumerate(xs)]
    seen = shown(scene, scene_snapshot(scene, (10.0, 8.0), states), team=(0, 1))
    assert seen["other.ahead_m"] == pytest.approx(35.0 - BROAD / 2 - 10.0 - HALF_EGO)
    assert seen["other.beside_m"] == pytest.approx(5.15 - 1.825)
    assert seen["other.speed_mps"] == pytest.approx(0.2)
    assert seen["body1.ahead_m"] == pytest.approx(30.0 - BROAD / 2 - 10.0 - HALF_EGO)


coordinate = st.floats(-500.0, 600.0)
angle = st.floats(-math.pi, math.pi)


@given(
    ego=st.tuples(coordinate, coordinate, st.floats(0.0, 55.0), angle),
    body=st.tuples(coordinate, coordinate, st.floats(0.0, 1.4), angle),
)
def test_whatever_happens_every_entry_is_within_its_bounds(
    straight_scene: Callable[..., Scene],
    scene_snapshot: Snapshots,
    ego: tuple[float, ...],
    body: tuple[float, ...],
) -> None:
    """Ego and body anywhere, at any speed: finite numbers within finite bounds, in float32."""
    scene = straight_scene([(30.0, -5.15, 0.0), (40.0, 5.15, math.pi)])
    other = (40.0, 5.15, 0.0, math.pi)
    observer = TeamObserver(scene, (0,))
    vector = observer.vector(scene_snapshot(scene, ego, [body, other]))
    assert vector.dtype == observer.low.dtype == observer.high.dtype == np.float32
    assert np.all(np.isfinite(observer.low) & np.isfinite(observer.high))
    assert np.all((observer.low <= vector) & (vector <= observer.high))
    assert observer.names == tuple(name for name, _, _ in entries(1, 1.4, 1.0))


@pytest.mark.parametrize("kind", ["pedestrian", "car", "bicycle"])
def test_an_episode_is_seen_whole(staged: Callable[..., tuple[BatchPlan, Site]], kind: str) -> None:
    """In SUMO, on foot and on wheels, each entry stays finite from the start to the end."""
    plan, site = staged("crossing", kind=kind, testers=2, end=20.0)
    setup = make_setup(plan.scenario, site)
    try:
        agents = [AGENTS.make("timing", {}) for _ in setup.teams]
        loop = EpisodeLoop(setup, agents, 5)
        observer = TeamObserver(loop.scene, setup.teams[0])
        seen = []
        while not loop.over:
            seen.append(observer.vector(loop.snapshot))
            loop.step()
    finally:
        setup.close()
    table = np.array(seen)
    assert np.isfinite(table).all()
    ahead = table[:, observer.names.index("body0.ahead_m")]
    assert ahead[-1] < ahead[0]
