"""The use of results by searchers: what is expected of points, and steps from failures."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from cavsumo.model.bodies import PEDESTRIAN
from cavsumo.model.scenario import BatchPlan
from cavsumo.network.site import Site
from cavsumo.searchers.expected import Expected
from cavsumo.searchers.manoeuvres import LEAST_ZONE, ManoeuvreSearch
from cavsumo.searchers.neighbours import FailedPoint, NeighbourSearch
from cavsumo.searchers.protocol import PlayedPoint
from cavsumo.searchers.space import Point, Space, space_of

UNFAIR = PlayedPoint(-2.4, False, body=0)
HELD = PlayedPoint(-1.2, False, body=0)
FAILED = PlayedPoint(2.0, True, (2.0, "left", 10.0), body=0, seconds=10.0)
MISSED = PlayedPoint(-3.2, False)


@pytest.fixture
def space(staged: Callable[..., tuple[BatchPlan, Site]]) -> Space:
    """Two pedestrians on the straight road, of whom the second acts by itself."""
    return space_of(staged("pedestrians")[1], PEDESTRIAN, ((0, 1),))


def point_of(space: Space, **numbers: float) -> Point:
    """A point whose second body acts by itself; ``zone_1`` is the zone of that body."""
    point = np.full(space.dimension, 0.35)
    for name, share in numbers.items():
        bare = name.removesuffix("_1")
        point[space.index(int(bare != name), bare)] = share
    return point


@pytest.mark.parametrize(
    ("result", "spoilt"),
    [
        pytest.param(UNFAIR, True, id="unfair"),
        pytest.param(PlayedPoint(-5.0, False), True, id="invalid"),
        pytest.param(HELD, False, id="held"),
        pytest.param(MISSED, False, id="missed"),
        pytest.param(PlayedPoint(-2.0, False), False, id="held-with-margin"),
        pytest.param(FAILED, False, id="failed"),
    ],
)
def test_unfair_and_invalid_points_are_spoilt(result: PlayedPoint, spoilt: bool) -> None:
    """By their grades."""
    assert result.spoilt is spoilt


def test_points_like_failures_are_expected_to_be_worth_more_than_those_like_unfair_ones(
    space: Space,
) -> None:
    """And points unlike any are in between."""
    expected = Expected(space)
    early, late, near_early, far, near_late = (
        point_of(space, zone=zone, company_1=0.0) for zone in (0.1, 0.9, 0.12, 0.5, 0.88)
    )
    expected.tell([early, late], [UNFAIR, FAILED])
    assert expected.value(near_early) < expected.value(far) < expected.value(near_late)
    assert expected.value(near_early) < 0.0


def test_only_the_body_that_the_verdict_names_is_held_to_account(space: Space) -> None:
    """The other one is none the worse for it."""
    expected = Expected(space)
    expected.tell([point_of(space, zone=0.2, zone_1=0.9)], [UNFAIR])
    alike, other = point_of(space, zone=0.2, zone_1=0.6), point_of(space, zone=0.6, zone_1=0.9)
    assert expected.value(alike) < -0.5 < expected.value(other)


def test_results_are_taken_up_once(space: Space) -> None:
    """Several searchers may tell the same."""
    expected, point = Expected(space), point_of(space, zone=0.2)
    expected.tell([point], [UNFAIR])
    value = expected.value(point)
    expected.tell([point], [UNFAIR])
    assert expected.value(point) == value


def test_of_points_of_which_nothing_is_known_the_nearer_one_is_preferred(space: Space) -> None:
    """The ego needs less time to get there."""
    expected = Expected(space)
    near, far = (point_of(space, place=place, company_1=0.0) for place in (0.02, 0.4))
    assert space.place(near, 0).along < space.place(far, 0).along
    assert expected.value(near) > expected.value(far)


def test_steps_from_a_failure_widen_while_neighbours_fail() -> None:
    """And narrow while they do not, within bounds."""
    one = FailedPoint(np.zeros(3), 2.0, 10.0)
    spread = one.spread
    one.tell(FAILED)
    assert one.spread > spread
    for _ in range(3):
        one.tell(HELD)
    assert one.spread < spread
    for _ in range(100):
        one.tell(MISSED)
    narrowest = one.spread
    one.tell(MISSED)
    assert one.spread == narrowest > 0.0


def test_hard_short_failures_whose_neighbours_fail_promise_most() -> None:
    """Each by itself."""
    base = FailedPoint(np.zeros(3), 2.0, 10.0, failed=2, spent=40.0)
    for better in ({"grade": 4.0}, {"seconds": 5.0}, {"failed": 3}, {"spent": 30.0}):
        one = FailedPoint(**{**vars(base), **better})
        assert one.promise > base.promise


def test_a_neighbour_that_is_unfair_costs_twice() -> None:
    """So failures at the border of what is unfair are varied less."""
    held, unfair = FailedPoint(np.zeros(3), 2.0, 10.0), FailedPoint(np.zeros(3), 2.0, 10.0)
    held.tell(HELD)
    unfair.tell(UNFAIR)
    assert held.promise > unfair.promise
    assert held.spread > unfair.spread


def test_the_search_climbs_towards_harder_failures(space: Space) -> None:
    """The hardest of a kind is kept; where harder ones lie in one direction it gets there."""
    searcher = NeighbourSearch(
        space, np.random.default_rng(1), ManoeuvreSearch(space, np.random.default_rng(2))
    )
    first, i = point_of(space, speed=0.2), space.index(0, "speed")

    def told(point: Point) -> PlayedPoint:
        speed = 4.0 * point[i]
        return PlayedPoint(speed, True, (float(speed // 2.0),), body=0, seconds=10.0)

    searcher.tell([first], [told(first)])
    for _ in range(12):
        points = searcher.ask()
        searcher.tell(points, [told(point) for point in points])
    assert sorted(searcher.failed) == [(0.0,), (1.0,)]
    assert max(one.grade for one in searcher.failed.values()) > 3.5


def test_against_an_ego_that_decides_now_and_then_nobody_comes_too_early(space: Space) -> None:
    """No first body of a known manoeuvre; against others some do."""

    def earliest(one: Space) -> float:
        searcher = ManoeuvreSearch(one, np.random.default_rng(1))
        return min(one.share(p, 0, "zone") for _ in range(3) for p in searcher.ask())

    assert earliest(space) < 0.2
    assert earliest(dataclasses.replace(space, every=1.0)) >= LEAST_ZONE["walks"] > 0.2
