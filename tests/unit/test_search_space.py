"""The search for tests without SUMO: the space and the searchers."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from cavsumo.agents.searched import programme_of
from cavsumo.errors import InputError, NetworkError
from cavsumo.model.bodies import CAR, PEDESTRIAN
from cavsumo.model.carriageway import Limit, Start
from cavsumo.model.geometry import Box, gap
from cavsumo.model.scenario import BatchPlan
from cavsumo.network.site import Site
from cavsumo.searchers.drives import Drives, drive_of
from cavsumo.searchers.manoeuvres import MANOEUVRES, PAIRS, ManoeuvreSearch
from cavsumo.searchers.methods import SEARCHERS, check_method, searcher_of
from cavsumo.searchers.places import Place
from cavsumo.searchers.portfolio import Portfolio
from cavsumo.searchers.protocol import GENERATION, PlayedPoint
from cavsumo.searchers.space import FURTHER, Point, Space, space_of
from cavsumo.searchers.walks import Walks, walk_of
from cavsumo.searchers.words import Failure, in_common

SIDES = (False, True)  # from the right, from the left


def seen(space: Space, point: Point) -> list[tuple[Place, Any]]:
    """Places and programmes of the bodies that take part."""
    return [(place, programme) for place, programme in space.played(point) if programme]


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
    assert programme_of(first["programmes"][0]) == seen(space, point)[0][1]
    (x, y), (u, v) = (memory["starts"][0][:2] for memory in (first, second))
    assert math.dist((x, y), (u, v)) > 1.2  # the place was taken
    point[space.index(1, "company")] = 0.2
    assert space.memories(point)[1]["programmes"] == [None]
    assert len(seen(space, point)) == 1


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


def test_two_that_act_together_meet_the_ego_near_each_other(space: Space) -> None:
    """At about the same moment, wherever the first one is; or as the ego reacts to it."""
    rng = np.random.default_rng(2)
    for _ in range(30):
        point = rng.random(space.dimension)
        point[space.index(1, "company")] = 0.8
        point[space.index(1, "reaction")] = 0.1
        (one, first), (other, second) = seen(space, point)
        assert abs(one.along - other.along) <= 8.0
        assert abs(first.cue - second.cue) <= 0.5
        point[space.index(1, "reaction")] = 0.7
        assert seen(space, point)[1][1].cue == "brakes"
        point[space.index(1, "reaction")] = 0.9
        assert seen(space, point)[1][1].cue == "speeds up"


@pytest.mark.parametrize(
    ("share", "same", "beyond"), [(0.3, True, 1.6), (0.8, False, 1.6), (0.2, True, -1.6)]
)
def test_the_place_of_the_second_is_relative_to_the_first(
    space: Space, share: float, same: bool, beyond: float
) -> None:
    """On the same side or on the other one, so far beyond it along the ego's path."""
    point = np.full(space.dimension, 0.5)
    point[space.index(0, "place")] = 0.3
    point[space.index(1, "place")] = share
    (one, _), (other, _) = space.played(point)
    assert (one.whence == other.whence) is same
    assert other.along - one.along == pytest.approx(beyond, abs=0.5)


def test_an_ego_that_decides_now_and_then_has_a_phase(space: Space) -> None:
    """One number more, for the first body alone."""
    slow = dataclasses.replace(space, every=1.0)
    assert slow.dimension == space.dimension + 1
    point = np.full(slow.dimension, 0.5)
    point[slow.index(0, "phase")] = 0.3
    (_, first), (_, second) = seen(slow, point)
    assert (first.every, first.phase) == (1.0, 0.3)
    assert second.every == 0.0


@pytest.fixture
def drives(staged: Callable[..., tuple[BatchPlan, Site]]) -> Space:
    """Two cars at the crossing."""
    return space_of(staged("crossing", kind="car")[1], CAR, ((0,), (1,)))


def test_vehicles_start_on_approaches_apart_from_each_other(drives: Space) -> None:
    """In time for the ego, from all sides that there are."""
    whence = {place.whence for place in drives.movements.places}
    assert whence == {"from the left", "from the right", "oncoming", "ahead of the ego"}
    rng = np.random.default_rng(3)
    for _ in range(50):
        bodies = drives.played(rng.random(drives.dimension))
        (a, b), ego = (place.start for place, _ in bodies), drives.site.route.path.at(0.0)
        assert a.approach is not None
        assert a.approach in drives.site.approaches
        for start in (a, b):
            assert 0.0 < start.v <= CAR.v_max
        boxes = [Box(s.x, s.y, s.o, CAR.length, CAR.width) for s in (a, b)]
        assert gap(*boxes) > 3.0
        assert min(gap(box, Box(*ego, CAR.length, CAR.width)) for box in boxes) > 3.0


def test_a_slow_vehicle_starts_where_it_is_in_time(drives: Space) -> None:
    """One that creeps and stops before it goes on needs more time from its line."""
    numbers = dict.fromkeys(Drives.meanings, 0.5)
    quick = numbers | {"depth": 1.0, "speed": 1.0, "zone": 0.3}
    slow = numbers | {"depth": 0.2, "resume": 0.4, "speed": 0.3, "zone": 0.3}
    soon, late = (set(drives.movements.suited(one)) for one in (quick, slow))
    assert late < soon <= set(drives.movements.places)
    ahead = {p for p in drives.movements.places if p.whence == "ahead of the ego"}
    assert ahead <= late  # they need no line
    assert {p.whence for p in late - ahead}


def test_the_side_of_a_vehicle_is_seen_from_the_ego(drives: Space) -> None:
    """Far from the ego's path it lies on that side."""
    for place in drives.movements.places:
        start = place.start
        beside = drives.site.route.path.project(start.x, start.y).lateral
        if place.whence in ("from the left", "from the right") and abs(beside) > 20.0:
            assert (beside > 0.0) == (place.whence == "from the left")


def test_a_memory_of_vehicles_is_plain_data(drives: Space) -> None:
    """The same programmes again after a way through JSON."""
    point = np.random.default_rng(4).random(drives.dimension)
    point[drives.index(1, "company")] = 0.5
    for memory, (_, programme) in zip(drives.memories(point), seen(drives, point), strict=True):
        (plain,) = json.loads(json.dumps(memory))["programmes"]
        assert programme_of(plain) == programme


def test_no_way_of_a_vehicle_is_refused(drives: Space) -> None:
    """The sentence names the network and the way out."""
    bare = dataclasses.replace(drives.site, approaches=())
    with pytest.raises(NetworkError, match="a search finds no way on which a car meets the ego"):
        space_of(bare, CAR, ((0,),))


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
    """Later points fail far more often than random ones."""
    alone = dataclasses.replace(space, teams=((0,),))
    searcher = searcher_of(method, alone, np.random.default_rng(5))
    failed: list[bool] = []
    for _ in range(40):
        points = searcher.ask()
        told = [_sphere(p) for p in points]
        searcher.tell(points, told)
        failed += [one.failed for one in told]
    random = np.mean([_sphere(p).failed for p in np.random.default_rng(5).random((400, 10))])
    assert np.mean(failed[-200:]) > random + 0.1


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


@pytest.mark.parametrize("kind", ["walks", "drives"])
def test_every_manoeuvre_is_within_the_space(kind: str, space: Space, drives: Space) -> None:
    """Its numbers are coordinates, in [0, 1]; each comes once, in the pairs two act together."""
    there = space if kind == "walks" else drives
    pairs = [ranges for pair in PAIRS[kind] for ranges in pair]
    for ranges in (*MANOEUVRES[kind].values(), *pairs):
        assert set(ranges) <= {*there.movements.meanings, *FURTHER}
        assert all(0.0 <= low <= high <= 1.0 for low, high in ranges.values())
    searcher = ManoeuvreSearch(there, np.random.default_rng(1))
    drawn = [p for _ in range(2) for p in searcher.ask()]
    assert all((point >= 0.0).all() and (point <= 1.0).all() for point in drawn)
    assert len(searcher.sorts) == len(MANOEUVRES[kind]) + len(PAIRS[kind]) < len(drawn)
    for point, manoeuvres in zip(drawn, searcher.sorts, strict=False):
        for body, ranges in enumerate(manoeuvres):
            for name, (low, high) in ranges.items():
                assert low <= there.share(point, body, name) <= high


def test_manoeuvres_that_cost_less_time_come_more_often(space: Space) -> None:
    """Of two that are worth as much the shorter one."""
    searcher = ManoeuvreSearch(space, np.random.default_rng(1))
    counts = {"short": 0, "long": 0}
    for _ in range(60):
        points = searcher.ask()
        sorts = [_sort(searcher, point) for point in points]
        counts["short"] += sorts.count(0)
        counts["long"] += sorts.count(1)
        told = [PlayedPoint(-1.2, False, seconds=10.0 if s == 0 else 60.0) for s in sorts]
        searcher.tell(points, told)
    assert counts["short"] > 1.5 * counts["long"]


def _sort(searcher: ManoeuvreSearch, point: Point) -> int:
    """The sort of manoeuvres of a point that was asked for last."""
    return searcher._drawn_as[point.tobytes()]


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


@pytest.mark.parametrize(
    ("numbers", "words"),
    [
        ({"depth": 0.9}, "runs the line"),
        ({"depth": 0.2, "resume": 0.2}, "creeps over the line and stops before the ego's way"),
        ({"depth": 0.4, "resume": 0.5}, "stops in the ego's way, waits for the ego"),
    ],
)
def test_features_of_vehicles(drives: Space, numbers: dict[str, float], words: str) -> None:
    """Kind, side, speed, manner, and whether others took part."""
    place = next(p for p in drives.movements.places if p.whence == "from the right")
    drive = drive_of(dict.fromkeys(Drives.meanings, 0.5) | numbers, CAR)
    said = in_common([Failure(place, drive, 1)], "car")
    assert said == f"car from the right, 5.0 m/s, {words}, with another one"
