"""The search for tests without SUMO: the space, the searchers, and the grade of an episode."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cavsumo.agents.searched import programme_of
from cavsumo.assertions.judgement import HELD, NOT_TRIGGERED, UNFAIR, VIOLATED, Judgement
from cavsumo.errors import InputError
from cavsumo.model.bodies import PEDESTRIAN
from cavsumo.model.carriageway import Limit, Start
from cavsumo.model.scenario import BatchPlan
from cavsumo.network.site import Site
from cavsumo.results.grade import INVALID_GRADE, grade
from cavsumo.searchers.manoeuvres import MANOEUVRES, ManoeuvreSearch
from cavsumo.searchers.methods import SEARCHERS, check_method, searcher_of
from cavsumo.searchers.neighbours import NeighbourSearch
from cavsumo.searchers.places import Place
from cavsumo.searchers.portfolio import Portfolio
from cavsumo.searchers.protocol import GENERATION, PlayedPoint, RandomSearch
from cavsumo.searchers.space import Point, Space, space_of
from cavsumo.searchers.walks import Walks, walk_of
from cavsumo.searchers.words import Failure, in_common
from cavsumo.simulation.avoidability import Avoidability

SIDES = (False, True)  # from the right, from the left


@pytest.fixture
def space(staged: Callable[..., tuple[BatchPlan, Site]]) -> Space:
    """Two pedestrians on the straight road."""
    return space_of(staged("pedestrians")[1], PEDESTRIAN, ((0,), (1,)))


def test_a_place_is_beside_the_path(space: Space) -> None:
    """From the right first, each in the order in which the ego comes there."""
    for left in SIDES:
        along = [place.along for place in space.movements.places if place.left is left]
        assert len(along) > 50
        assert along == sorted(along)
    path = space.site.route.path
    for place in space.movements.places:
        assert (path.project(place.start.x, place.start.y).lateral > 0.0) is place.left


def test_a_point_is_starts_and_programmes(space: Space) -> None:
    """Each body its own; the second stands by where its company is small."""
    point = np.full(space.dimension, 0.3)
    first, second = space.memories(point)
    assert len(first["starts"]) == len(second["starts"]) == 1
    assert first["programmes"] == second["programmes"]
    assert programme_of(first["programmes"][0]) == space.seen(point)[0][1]
    (x, y), (u, v) = (memory["starts"][0][:2] for memory in (first, second))
    assert math.dist((x, y), (u, v)) > 1.2  # the place was taken
    point[space.index(1, "company")] = 0.2
    assert space.memories(point)[1]["programmes"] == [None]
    assert len(space.seen(point)) == 1


def test_every_number_of_a_point_has_a_body_and_a_name(space: Space) -> None:
    """No two numbers have the same, and a number is found by them."""
    assert len(set(space.coordinates)) == space.dimension
    assert {c.body for c in space.coordinates} == {0, 1}
    point = np.arange(space.dimension) / space.dimension
    for i, (body, name) in enumerate(space.coordinates):
        assert space.share(point, body, name) == point[i]
    with pytest.raises(KeyError):
        space.index(0, "company")  # the first body always takes part


def test_a_slow_body_starts_where_it_is_in_time(space: Space) -> None:
    """The longer it walks to the ego's strip, the farther along the path; all if nowhere."""
    quick = {name: 0.5 for name in space.movements.meanings} | {"speed": 1.0, "depth": 1.0}
    slow = quick | {"speed": 0.5}
    firsts: list[dict[bool, float]] = []

    def limited(speed: float) -> Any:
        movements: Any = space.movements
        return dataclasses.replace(movements, limits=(Limit(0.0, speed),))

    for shares in (quick, slow):
        suited = limited(7.0).suited(shares)
        assert set(suited) < set(space.movements.places)
        firsts.append({left: min(p.along for p in suited if p.left is left) for left in SIDES})
    assert all(firsts[0][left] + 5.0 < firsts[1][left] for left in SIDES)
    assert firsts[0][False] < firsts[0][True]  # from the left it is farther to the strip
    assert limited(500.0).suited(quick) == space.movements.places


def test_a_programme_stays_within_natural_limits() -> None:
    """At the corners of the cube, and the pause ends by time or by the place of the ego."""
    rng = np.random.default_rng(1)
    size = len(Walks.meanings)
    for numbers in [[0.0] * size, [1.0] * size, *rng.random((50, size)).tolist()]:
        walk = walk_of(dict(zip(Walks.meanings, numbers, strict=True)), PEDESTRIAN)
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
    alone = dataclasses.replace(space, teams=((0,),))
    searcher = searcher_of(method, alone, np.random.default_rng(5))
    grades: list[float] = []
    for _ in range(60):
        points = searcher.ask()
        told = [_sphere(p) for p in points]
        searcher.tell(points, told)
        grades += [one.grade for one in told]
    assert np.mean(sorted(grades[-200:])[100:]) > np.mean(sorted(grades[:200])[100:]) + 0.03


def test_neighbours_are_those_of_fair_tests(space: Space) -> None:
    """Of points that nobody met, or unfairly, only while there are no others."""
    rng = np.random.default_rng(2)
    points = list(rng.random((10, space.dimension)))
    searcher = NeighbourSearch(space, rng, RandomSearch(space, rng))
    for grades in ([-3.2] * 10, [-2.4, -1.5] + [-3.2] * 8):
        searcher.tell(points, [PlayedPoint(grade, False) for grade in grades])
        near = [np.argmin([np.linalg.norm(one - p) for p in points]) for one in searcher.ask()]
        assert (set(near) == {1}) is (max(grades) > -2.0)


def test_a_portfolio_goes_on_from_what_was_found(space: Space) -> None:
    """After failures near the middle most points are there, as neighbours of them."""
    portfolio, far = Portfolio(space, np.random.default_rng(1)), list[float]()
    for generation in range(20):
        points = portfolio.ask()
        if generation == 0:
            points = [0.5 + 0.1 * (point - 0.5) for point in points]
        told = [
            _sphere(p) if len(p) == space.dimension else PlayedPoint(-3.5, False) for p in points
        ]
        portfolio.tell(points, told)
        far += [-one.grade for one in told]
    assert np.mean([one < 0.0 for one in far[50:]]) > 0.5


def test_a_method_whose_package_is_missing_is_refused(
    space: Space, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the command that brings it."""
    monkeypatch.setattr("cavsumo.searchers.diversity.find_spec", lambda name: None)
    check_method("portfolio", space)
    with pytest.raises(InputError, match=r"needs ribs: pip install 'cavsumo\[search\]'"):
        check_method("diversity", space)


def test_every_manoeuvre_is_within_the_space(space: Space) -> None:
    """Its numbers are numbers of the space, in [0, 1], and a round has all of them."""
    for ranges in MANOEUVRES[space.movements.name].values():
        assert set(ranges) <= set(space.movements.meanings)
        assert all(0.0 <= low <= high <= 1.0 for low, high in ranges.values())
    drawn = [p for _ in range(2) for p in ManoeuvreSearch(space, np.random.default_rng(1)).ask()]
    assert all((point >= 0.0).all() and (point <= 1.0).all() for point in drawn)


def test_features_that_most_failures_share() -> None:
    """Side, speed, angle, manner."""
    walk = walk_of(dict.fromkeys(Walks.meanings, 0.5), PEDESTRIAN)
    slow = walk._replace(speed=0.5, heading=-1.0, depth=3.0)
    failure = Failure(Place(Start(0.0, 0.0, 0.0), "from the left", 30.0), slow)
    assert in_common([failure, failure], "pedestrian") == (
        "pedestrian from the left, 0.5 m/s, 57 degrees towards the ego, "
        "crosses the ego's way at once, waits for the ego"
    )
    assert in_common([], "pedestrian") == ""


def _episode(judgement: Judgement, outcome: str = "", min_gap: float = 1.0) -> Any:
    """An episode that nobody saw, so that nobody was near."""
    contacts = SimpleNamespace(min_gap=min_gap)
    return SimpleNamespace(
        judgement=judgement, outcome=outcome or judgement.verdict, contacts=contacts, seen=[]
    )


def test_grades_order_episodes() -> None:
    """From invalid over nobody met, unfair, held and unpreventable to a hard impact."""
    hit = Judgement("collision", VIOLATED, "tester0", impact_speed=3.0, robustness=-3.0)
    late = Judgement("reaction-zone", UNFAIR, "tester0", ego_speed=8.0)
    cases = [
        (_episode(hit, "invalid"), None),
        (_episode(Judgement("", NOT_TRIGGERED)), None),
        (_episode(late, min_gap=1.0), None),
        (_episode(late, min_gap=3.0), None),
        (_episode(Judgement("reaction-zone", HELD, "tester0")), None),
        (_episode(hit), Avoidability(False, perceived=5.0)),
        (_episode(hit), Avoidability(False, last_chance=4.0, perceived=5.0)),
        (_episode(hit), Avoidability(False, last_chance=4.8, perceived=5.0)),
        (_episode(hit), Avoidability(True, last_chance=5.0, perceived=4.0)),
        (_episode(dataclasses.replace(hit, impact_speed=8.0)), Avoidability(True)),
    ]
    grades = [grade(*case) for case in cases]
    assert grades == sorted(grades)
    assert len(set(grades)) == len(grades)
    assert grades[0] == INVALID_GRADE
    assert grades[-2:] == [3.0, 8.0]
    assert sum(g >= 0.0 for g in grades) == 2
