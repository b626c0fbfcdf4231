"""The search for tests without SUMO: the space and the searchers."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cavsumo.model.bodies import PEDESTRIAN
from cavsumo.model.scenario import BatchPlan
from cavsumo.network.site import Site
from cavsumo.searchers.manoeuvres import MANOEUVRES, ManoeuvreSearch
from cavsumo.searchers.methods import SEARCHERS, searcher_of
from cavsumo.searchers.protocol import GENERATION, PlayedPoint
from cavsumo.searchers.space import NAMES, Point, Space, programme, space_of
from cavsumo.searchers.words import in_common


@pytest.fixture
def space(staged: Callable[..., tuple[BatchPlan, Site]]) -> Space:
    """Two pedestrians on the straight road."""
    return space_of(staged("pedestrians")[1], PEDESTRIAN, ((0,), (1,)))


def test_a_place_is_beside_the_path(space: Space) -> None:
    """From the right first, each in the order in which the ego comes there."""
    for left in (False, True):
        along = [place.along for place in space.places if place.left is left]
        assert len(along) > 50
        assert along == sorted(along)
    path = space.site.route.path
    for place in space.places:
        assert (path.project(place.start.x, place.start.y).lateral > 0.0) is place.left


def test_a_point_is_starts_and_programmes(space: Space) -> None:
    """Each body its own; the second takes part below one half of its last number."""
    point = np.full(space.dimension, 0.25)
    first, second = space.memories(point)
    assert len(first["starts"]) == len(second["starts"]) == 1
    assert first["programmes"] == second["programmes"]
    assert len(first["programmes"][0]) == len(NAMES)
    (x, y), (u, v) = (memory["starts"][0][:2] for memory in (first, second))
    assert math.dist((x, y), (u, v)) > 1.2  # the place was taken
    point[-1] = 0.75
    assert space.memories(point)[1]["programmes"] == [None]
    assert len(space.seen(point)) == 1


def test_a_programme_stays_within_natural_limits() -> None:
    """At the corners of the cube, and the pause ends by time or by the place of the ego."""
    rng = np.random.default_rng(1)
    for numbers in [[0.0] * 10, [1.0] * 10, *rng.random((50, 10)).tolist()]:
        walk = programme(numbers, PEDESTRIAN)
        for speed in (walk.speed, walk.speed_2):
            assert 0.3 <= speed <= PEDESTRIAN.v_max
        assert abs(walk.heading) < math.pi / 2
        assert walk.pause == 0.0 or walk.resume is None


def _sphere(point: Point) -> PlayedPoint:
    """A failure near the middle of the cube."""
    far = float(np.abs(point - 0.5).mean())
    return PlayedPoint(0.2 - far, far < 0.2, (round(10 * point[0]),))


@pytest.mark.parametrize("method", SEARCHERS)
def test_points_depend_on_seed_and_results_alone(space: Space, method: str) -> None:
    """All in the cube, as many as a generation has, and the same again."""

    def asked() -> list[list[float]]:
        searcher = searcher_of(method, space, np.random.default_rng(3))
        found = []
        for _ in range(12):
            points = searcher.ask()
            assert len(points) == GENERATION
            searcher.tell(points, [_sphere(p) for p in points])
            found += [p.tolist() for p in points]
        return found

    first = asked()
    assert all(0.0 <= u <= 1.0 for point in first for u in point)
    assert first == asked()
    assert len({tuple(point) for point in first}) == len(first)


@pytest.mark.parametrize("method", ["portfolio", "neighbours", "cma"])
def test_what_was_good_is_looked_at_more_closely(space: Space, method: str) -> None:
    """Later points are nearer to the failures than random ones."""
    searcher = searcher_of(method, space, np.random.default_rng(5))
    grades: list[float] = []
    for _ in range(60):
        points = searcher.ask()
        told = [_sphere(p) for p in points]
        searcher.tell(points, told)
        grades += [one.grade for one in told]
    assert np.mean(sorted(grades[-200:])[100:]) > np.mean(sorted(grades[:200])[100:]) + 0.03


def test_every_manoeuvre_is_within_the_space(space: Space) -> None:
    """Its numbers are numbers of the space, in [0, 1], and a round has all of them."""
    for ranges in MANOEUVRES.values():
        assert set(ranges) <= set(NAMES)
        assert all(0.0 <= low <= high <= 1.0 for low, high in ranges.values())
    drawn = [p for _ in range(2) for p in ManoeuvreSearch(space, np.random.default_rng(1)).ask()]
    assert all((point >= 0.0).all() and (point <= 1.0).all() for point in drawn)


def test_features_that_most_failures_share() -> None:
    """Side, speed, angle, manner."""
    walk = programme([0.5] * 10, PEDESTRIAN)
    slow = walk._replace(speed=0.5, heading=-1.0, depth=3.0)
    place: Any = SimpleNamespace(left=True)
    assert in_common([(place, slow), (place, slow)]) == (
        "from the left, 0.5 m/s, 57 degrees towards the ego, crosses the ego's way at once"
    )
    assert in_common([]) == ""
