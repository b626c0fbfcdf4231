"""Polylines: by hand, and against shapely."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import accumulate, pairwise

import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from shapely.geometry import LineString, Point
from shapely.ops import substring

from cavsumo.agents.base import Scene
from cavsumo.model.bodies import CAR, Body
from cavsumo.model.polyline import Path
from cavsumo.model.snapshot import BodyState, Snapshot

CALM = settings(deadline=None)
CORNER = [(0.0, 0.0), (10.0, 0.0), (10.0, 5.0)]  # 10 m east, then 5 m north

numbers = st.floats(-50.0, 50.0)
points = st.tuples(numbers, numbers)
lines = st.lists(points, min_size=2, max_size=8).filter(
    lambda ps: all(math.dist(p, q) > 1e-3 for p, q in pairwise(ps))
)
# Lines that never turn back: x grows, and no piece is steeper than 45 degrees.
pieces = st.lists(st.tuples(st.floats(0.5, 5.0), st.floats(-0.99, 0.99)), min_size=1, max_size=12)


def graph(steps: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """The points of a line that never turns back, from its pieces (length in x, slope)."""
    xs = accumulate((dx for dx, _ in steps), initial=0.0)
    ys = accumulate((dx * slope for dx, slope in steps), initial=0.0)
    return list(zip(xs, ys, strict=True))


def turned(point: tuple[float, float], angle: float) -> tuple[float, float]:
    """A point turned about the origin."""
    c, s = math.cos(angle), math.sin(angle)
    return point[0] * c - point[1] * s, point[0] * s + point[1] * c


# By hand ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("point", "along", "lateral", "segment"),
    [
        ((4.0, 2.0), 4.0, 2.0, 0),  # left of the first piece
        ((4.0, -3.0), 4.0, -3.0, 0),  # right of it
        ((12.0, 1.0), 11.0, -2.0, 1),  # right of the second, which leads north
        ((9.0, 3.0), 13.0, 1.0, 1),
        ((10.0, 0.0), 10.0, 0.0, 0),  # on the corner
        ((13.0, -4.0), 10.0, -5.0, 0),  # outside the corner of a left turn: to the right
        ((-3.0, 4.0), 0.0, 5.0, 0),  # before its beginning
        ((10.0, 8.0), 15.0, 3.0, 1),  # beyond its end
    ],
)
def test_projections_on_a_corner_by_hand(
    point: tuple[float, float], along: float, lateral: float, segment: int
) -> None:
    """The nearest point of the path, how far along it is, and on which side one stands."""
    found = Path(CORNER).project(*point)
    assert found == pytest.approx((along, lateral, segment))


@pytest.mark.parametrize(
    ("along", "pose"),
    [
        (0.0, (0.0, 0.0, 0.0)),
        (4.0, (4.0, 0.0, 0.0)),
        (10.0, (10.0, 0.0, math.pi / 2)),
        (12.0, (10.0, 2.0, math.pi / 2)),
        (15.0, (10.0, 5.0, math.pi / 2)),
        (-2.0, (-2.0, 0.0, 0.0)),  # prolonged backwards
        (18.0, (10.0, 8.0, math.pi / 2)),  # prolonged onwards
    ],
)
def test_points_at_an_arc_length_by_hand(along: float, pose: tuple[float, float, float]) -> None:
    """Ten metres lead to the corner, more lead north, and the ends are prolonged straight."""
    assert Path(CORNER).at(along) == pytest.approx(pose)


@pytest.mark.parametrize(
    ("ray", "met"),
    [
        ((3.0, -4.0, math.pi / 2), (4.0, 3.0)),  # north, onto the first piece
        ((6.0, 2.0, 0.0), (4.0, 12.0)),  # east, onto the second
        ((3.0, -4.0, -math.pi / 2), None),  # away from it
        ((0.0, 7.0, 0.0), None),  # past its end
        ((20.0, 2.0, math.pi), (10.0, 12.0)),
        ((7.0, -3.0, math.pi / 4), (3.0 * math.sqrt(2), 10.0)),  # both at the corner
        ((8.0, 4.0, -math.pi / 4), (2.0 * math.sqrt(2), 12.0)),  # the second before the first
        ((3.0, 2.0, 0.0), (7.0, 12.0)),  # parallel to the first piece
    ],
)
def test_meetings_of_rays_by_hand(
    ray: tuple[float, float, float], met: tuple[float, float] | None
) -> None:
    """How far a ray goes until it first meets the path, and where on the path that is."""
    found = Path(CORNER).meet(*ray)
    assert found == (None if met is None else pytest.approx(met))


def test_a_cut_keeps_the_corner_between_its_ends() -> None:
    """From 8 m to 12 m: two metres before the corner to two behind it."""
    part = Path(CORNER).cut(8.0, 12.0)
    assert part.points == ((8.0, 0.0), (10.0, 0.0), (10.0, 2.0))
    assert part.length == 4.0


def test_points_given_twice_are_taken_once() -> None:
    """Lanes that follow each other share their end points, which makes no piece of no length."""
    assert Path([(0, 0), (1, 0), (1, 0), (2, 0)]).points == ((0, 0), (1, 0), (2, 0))


@pytest.mark.parametrize("points", [[], [(1.0, 2.0)], [(1.0, 2.0), (1.0, 2.0)]])
def test_a_single_point_is_no_path(points: list[tuple[float, float]]) -> None:
    """Without two different points there is no direction."""
    with pytest.raises(ValueError, match="two different points"):
        Path(points)


# Against shapely ----------------------------------------------------------------------------------


@CALM
@given(lines, points)
def test_projections_equal_shapelys(
    line: list[tuple[float, float]], p: tuple[float, float]
) -> None:
    """The path is as far away as shapely says, at the arc length where it is nearest."""
    path, reference = Path(line), LineString(line)
    found = path.project(*p)
    assert path.length == pytest.approx(reference.length)
    assert abs(found.lateral) == pytest.approx(reference.distance(Point(p)), abs=1e-9)
    # The nearest point may be on two pieces at once; then either arc length is right.
    assert reference.interpolate(found.along).distance(Point(p)) == pytest.approx(
        abs(found.lateral), abs=1e-7
    )


@CALM
@given(pieces, st.floats(0.0, 1.0), st.floats(-20.0, 20.0), st.floats(-4.0, 4.0))
def test_above_a_path_that_leads_east_is_left(
    steps: list[tuple[float, float]], share: float, height: float, angle: float
) -> None:
    """Lateral is positive to the left of the direction of travel, whichever way the path leads."""
    assume(abs(height) > 1e-3)
    line = graph(steps)
    x, y, _ = Path(line).at(share * Path(line).length)
    path = Path([turned(p, angle) for p in line])
    found = path.project(*turned((x, y + height), angle))
    assert found.lateral * height > 0.0


@CALM
@given(lines, st.floats(0.0, 1.0))
def test_points_at_an_arc_length_equal_shapelys(
    line: list[tuple[float, float]], share: float
) -> None:
    """The point at an arc length is shapely's."""
    path, reference = Path(line), LineString(line)
    x, y, _ = path.at(share * path.length)
    assert reference.interpolate(share, normalized=True).distance(Point(x, y)) < 1e-7


@CALM
@given(lines, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_cuts_equal_shapelys(line: list[tuple[float, float]], a: float, b: float) -> None:
    """A part of a path is shapely's substring, and as long as its ends are apart."""
    path = Path(line)
    start, end = sorted((a * path.length, b * path.length))
    assume(end - start > 1e-2)
    part = path.cut(start, end)
    reference = substring(LineString(line), start, end)
    assert part.length == pytest.approx(end - start, abs=1e-5)
    assert LineString(part.points).hausdorff_distance(reference) < 1e-5


@CALM
@given(pieces, st.floats(0.0, 1.0), st.floats(0.1, 20.0), st.floats(-4.0, 4.0))
@example([(1.0, 0.5), (1.0, -0.5)], 0.5, 3.0, 0.3)
def test_a_ray_meets_the_path_that_it_points_at(
    steps: list[tuple[float, float]], share: float, below: float, angle: float
) -> None:
    """From straight below a point of a path that leads east, a ray upwards meets that point."""
    line = graph(steps)
    along = min(max(share, 0.01), 0.99) * Path(line).length
    x, y, _ = Path(line).at(along)
    path = Path([turned(p, angle) for p in line])
    met = path.meet(*turned((x, y - below), angle), math.pi / 2 + angle)
    assert met is not None, "the ray slipped through"
    assert met == pytest.approx((below, along), abs=1e-6)
    assert path.meet(*turned((x, y - below), angle), -math.pi / 2 + angle) is None


@CALM
@given(lines, points, st.floats(-4.0, 4.0))
def test_meetings_equal_shapelys(
    line: list[tuple[float, float]], p: tuple[float, float], heading: float
) -> None:
    """The distance to the first meeting is shapely's distance to the cut of ray and path."""
    path = Path(line)
    reach = (p[0] + 400 * math.cos(heading), p[1] + 400 * math.sin(heading))
    ray, reference = LineString([p, reach]), LineString(line)
    # Near misses are decided by the last digit: only clear cuts and clear misses are compared.
    assume(all(ray.distance(Point(q)) > 1e-6 for q in line) and reference.distance(Point(p)) > 1e-6)
    met, cut = path.meet(*p, heading), ray.intersection(reference)
    if met is None:
        assert cut.is_empty
        return
    assert met[0] == pytest.approx(Point(p).distance(cut), abs=1e-6)
    assert reference.interpolate(met[1]).distance(ray) < 1e-6


# With the last segment as a hint ------------------------------------------------------------------


@CALM
@given(pieces, st.floats(-0.3, 0.3))
def test_the_last_segment_is_hint_enough_for_a_walker(
    steps: list[tuple[float, float]], lateral: float
) -> None:
    """Who moves a little at a time is found by looking near the last place only."""
    path = Path(graph(steps))
    near: int | None = None
    for i in range(int(path.length / 0.14) + 1):
        x, y, o = path.at(0.14 * i)
        place = (x - lateral * math.sin(o), y + lateral * math.cos(o))
        found = path.project(*place, near)
        assert found == path.project(*place)
        near = found.segment


@pytest.mark.parametrize("stride", [0.5, *(pytest.param(stride) for stride in (1.4, 5.0, 13.9))])
def test_the_progress_of_a_fast_ego_on_a_finely_drawn_curve(
    straight_scene: Callable[..., Scene], stride: float
) -> None:
    """However far the ego drives in a timestep, its progress is where it is on its path."""
    bend = [(20 * math.sin(i / 40), 20 - 20 * math.cos(i / 40)) for i in range(80)]  # 0.5 m each
    scene = straight_scene()
    scene = Scene(0.1, Body("ego", CAR), Path(bend), scene.bodies, scene.starts)
    for step in range(int(scene.ego_path.length / stride)):
        x, y, o = scene.ego_path.at(stride * step)
        snapshot = Snapshot(step, 0.1 * step, BodyState(scene.ego, x, y, 9.0, o), 0.0, ())
        assert scene.ego_progress(snapshot) == pytest.approx(stride * step, abs=0.01)
