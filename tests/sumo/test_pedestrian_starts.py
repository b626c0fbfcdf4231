"""What a network offers the testers: the carriageway, the ways across it, where they start."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import shapely
from shapely.geometry import LineString, Polygon
from support import prepared_at

from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import job
from cavsumo.errors import NetworkError
from cavsumo.model.bodies import KINDS, PEDESTRIAN, Kind
from cavsumo.model.carriageway import BEYOND_M, Crossing, Roads, Start
from cavsumo.model.geometry import Box, corners
from cavsumo.model.polyline import Path as Polyline
from cavsumo.model.seeds import starts_generator
from cavsumo.model.stopping_way import is_clear
from cavsumo.network.pedestrian_starts import (
    APART_M,
    NEAR_M,
    StartingArea,
    clear_starts,
    draw_starts,
    room,
)
from cavsumo.network.reader import lane_shape, read_network
from cavsumo.network.site import Site
from cavsumo.simulation.loop import EpisodeLoop

Staged = Callable[..., Any]
ALL = pytest.mark.parametrize("name", ["pedestrians", "crossing", "junction"])
TRIO = [PEDESTRIAN] * 3


def on(crossing: Crossing, distance: float) -> tuple[float, float]:
    """The point of a way across after that distance."""
    c, s = math.cos(crossing.heading), math.sin(crossing.heading)
    return crossing.x + distance * c, crossing.y + distance * s


def draws(site: Site, seeds: int = 100) -> Iterator[tuple[Start, ...]]:
    """The starts of three pedestrians in many episodes."""
    for seed in range(seeds):
        yield draw_starts(site.areas, TRIO, np.random.default_rng(seed))


def lanes_of(file: Path, pavements: bool) -> dict[str, shapely.Geometry]:
    """The surfaces of the lanes for pedestrians only, or of all others, straight from the XML."""
    return {
        lane.get("id", ""): LineString(
            [tuple(map(float, point.split(",")[:2])) for point in lane.get("shape", "").split()]
        ).buffer(float(lane.get("width", "3.2")) / 2, cap_style="flat", join_style="mitre")
        for edge in ElementTree.parse(file).iter("edge")
        for lane in edge.iter("lane")
        if edge.get("function") is None and (lane.get("allow") == "pedestrian") == pavements
    }


# The carriageway


@ALL
def test_the_carriageway_is_where_cars_drive(
    staged: Staged, networks: dict[str, Path], name: str
) -> None:
    """The middle of every lane for cars lies on it, the middle of every pavement does not."""
    roads = staged(name)[1].roads
    cars, feet = lanes_of(networks[name], False), lanes_of(networks[name], True)
    assert all(roads.contains(*p) for a in cars.values() for p in _inside(a))
    assert not any(roads.contains(*p) for a in feet.values() for p in _inside(a))
    assert len(cars) > 1
    assert len(feet) > 1


def _inside(area: shapely.Geometry) -> list[tuple[float, float]]:
    """A point in the middle of a surface."""
    point = area.representative_point()
    return [(point.x, point.y)]


def test_the_straight_road_is_measured_exactly(staged: Staged) -> None:
    """99 m long, 7.3 m wide, its edge 1.5 m from the middle of the pavement."""
    roads: Roads = staged()[1].roads
    assert roads.carriageway.bounds == pytest.approx((0.0, -3.65, 99.0, 3.65), abs=1e-6)
    assert roads.carriageway.area == pytest.approx(99.0 * 7.3)
    assert roads.edge_distance(50.0, -5.15) == pytest.approx(1.5)
    assert roads.edge_distance(50.0, 0.0) == pytest.approx(3.65)


def test_marked_crossings_lie_between_pavements_and_over_roads(
    staged: Staged, networks: dict[str, Path]
) -> None:
    """The surface of each crossing lies on the carriageway for the most part, not on pavements."""
    site = staged("junction")[1]
    pavements = shapely.union_all(list(lanes_of(networks["junction"], True).values()))
    for part in site.crossings.geoms:
        assert part.intersection(site.roads.carriageway).area > 0.5 * part.area
        assert part.intersection(pavements).area < 0.2 * part.area


# Ways across


def test_the_way_across_the_straight_road_by_hand(staged: Staged) -> None:
    """From either pavement straight over, 1.5 m before the kerb to 1.5 m behind the other one."""
    roads: Roads = staged()[1].roads
    for y, heading in ((-5.15, math.pi / 2), (5.15, -math.pi / 2)):
        way = roads.crossing(40.0, y)
        assert way is not None
        assert way.heading == pytest.approx(heading)
        assert (way.enter, way.leave, way.length) == pytest.approx((1.5, 8.8, 10.3))
        assert way.progress(*on(way, 4.0)) == pytest.approx(4.0)
        assert on(way, way.length) == pytest.approx((40.0, -y))


def test_a_body_on_the_road_leaves_it_over_the_nearest_lane(staged: Staged) -> None:
    """Who stands on the carriageway has entered it, and walks a little past the far kerb."""
    way = staged()[1].roads.crossing(40.0, -3.0)
    assert way is not None
    assert way.enter == pytest.approx(0.0, abs=1e-6)
    assert way.length == pytest.approx(way.leave + BEYOND_M)
    assert way.leave == pytest.approx(6.65)


@pytest.mark.parametrize(("island", "leave"), [(1.0, 11.0), (2.0, 6.0)])
def test_a_narrow_island_is_walked_over(island: float, leave: float) -> None:
    """Two carriageways of 4 m: a strip of 1 m between them is no stop, one of 2 m is."""
    strips = [shapely.box(0, 0, 50, 4), shapely.box(0, 4 + island, 50, 8 + island)]
    lanes = [LineString([(0, 2), (50, 2)]), LineString([(50, 6 + island), (0, 6 + island)])]
    way = Roads(shapely.union_all(strips), lanes).crossing(25.0, -2.0)
    assert way is not None
    assert (way.enter, way.leave) == pytest.approx((2.0, leave))


@ALL
def test_every_way_across_leads_straight_over_to_the_other_side(staged: Staged, name: str) -> None:
    """From each start at right angles to a lane: in before out, road between, none at the end."""
    roads: Roads = staged(name)[1].roads
    for start in (s for trio in draws(staged(name)[1]) for s in trio):
        way = roads.crossing(start.x, start.y)
        assert way is not None
        assert 0.0 < way.enter < way.leave < way.length
        assert way.length - way.leave == pytest.approx(way.enter)
        assert not roads.contains(start.x, start.y)
        assert roads.contains(*on(way, (way.enter + way.leave) / 2))
        assert not roads.contains(*on(way, way.length))
        assert _slant(roads, way) < 0.15


def _slant(roads: Roads, way: Crossing) -> float:
    """How far a way is from right angles to the lane nearest to its start [rad]."""
    start = shapely.Point(way.x, way.y)
    lane = min(roads.lanes, key=start.distance)
    along = lane.project(start)
    a, b = lane.interpolate(max(0.0, along - 1.0)), lane.interpolate(along + 1.0)
    cosine = (
        (b.x - a.x) * math.cos(way.heading) + (b.y - a.y) * math.sin(way.heading)
    ) / math.dist((a.x, a.y), (b.x, b.y))
    return abs(math.asin(cosine))


# Where testers start


@ALL
def test_starting_areas_lie_beside_the_egos_path(staged: Staged, name: str) -> None:
    """Along each area, the way across the road crosses the ego's path."""
    site: Site = staged(name)[1]
    ego = LineString(site.route.path.points)
    assert site.areas
    for area in site.areas:
        assert 0.0 <= area.begin < area.end <= area.pavement.length + 1e-6
        for along in np.arange(area.begin + 0.5, area.end - 0.49, 1.0):
            way = site.roads.crossing(*area.pavement.at(float(along))[:2])
            assert way is not None
            assert way.enter <= NEAR_M
            line = LineString([(way.x, way.y), on(way, way.leave)])
            assert line.distance(ego) < 0.1


@ALL
def test_testers_start_with_their_whole_box_on_a_pavement(
    staged: Staged, networks: dict[str, Path], name: str
) -> None:
    """Facing along it either way, no corner is off the pavement or on the carriageway."""
    site: Site = staged(name)[1]
    pavements = shapely.union_all(list(lanes_of(networks[name], True).values())).buffer(1e-6)
    for start in (s for trio in draws(site) for s in trio):
        box = Box(start.x, start.y, start.o, PEDESTRIAN.length, PEDESTRIAN.width)
        outline = Polygon(corners(box))
        assert outline.within(pavements)
        assert not outline.intersects(site.roads.carriageway)
        assert start.pavement is not None
        here = start.pavement.project(start.x, start.y)
        axis = start.pavement.at(here.along)[2] + (0.0 if start.forwards else math.pi)
        assert math.cos(start.o - axis) == pytest.approx(1.0)
        assert here.lateral == pytest.approx(start.lateral, abs=1e-6)


@pytest.mark.parametrize(
    "name",
    [
        "pedestrians",
        "junction",
        pytest.param(
            "crossing",
        ),
    ],
)
def test_testers_start_inside_a_starting_area(staged: Staged, name: str) -> None:
    """A start lies between the begin and the end of an area, so that its way meets the ego's."""
    site: Site = staged(name)[1]
    for start in (s for trio in draws(site) for s in trio):
        assert start.pavement is not None
        along = start.pavement.project(start.x, start.y).along
        areas = [a for a in site.areas if a.pavement is start.pavement]
        assert any(a.begin - 1e-6 <= along <= a.end + 1e-6 for a in areas)


@ALL
def test_testers_keep_apart_at_the_start(staged: Staged, name: str) -> None:
    """No two testers start so close that they touch, whichever way they face."""
    for trio in draws(staged(name)[1]):
        spots = [(s.x, s.y) for s in trio]
        assert min(math.dist(spots[i], spots[i - 1]) for i in range(3)) > APART_M
    assert 2 * PEDESTRIAN.reach < APART_M


@ALL
def test_testers_have_room_to_stop_before_each_other(staged: Staged, name: str) -> None:
    """Also those that walk towards each other."""
    for trio in draws(staged(name)[1]):
        for i, start in enumerate(trio):
            rooms = [room(other, PEDESTRIAN) for other in trio[:i]]
            assert is_clear(room(start, PEDESTRIAN), rooms)


def test_a_start_in_a_car_is_drawn_again() -> None:
    """And nobody else's; the same generator gives the same start."""
    area = StartingArea(Polyline([(0.0, 0.0), (60.0, 0.0)]), 0.0, 60.0, 4.0, ("edge",))
    kinds = TRIO
    for seed in range(30):
        starts = draw_starts([area], kinds, np.random.default_rng(seed))
        hit = starts[seed % 3]
        cars = [Box(hit.x, hit.y, 0.3, 4.5, 1.8), Box(30.0, 0.0, 0.0, 4.5, 1.8)]
        again = [
            clear_starts([area], kinds, starts, cars, np.random.default_rng(7)) for _ in range(2)
        ]
        assert again[0] == again[1]
        rooms = [room(start, PEDESTRIAN) for start in again[0]]
        assert all(is_clear(one, cars) for one in rooms)
        kept = [is_clear(room(start, PEDESTRIAN), cars) for start in starts]
        assert [a == b for a, b in zip(starts, again[0], strict=True)] == kept
        spots = [(s.x, s.y) for s in again[0]]
        assert min(math.dist(spots[i], spots[i - 1]) for i in range(3)) > APART_M


def test_a_start_is_moved_along_where_no_draw_helps() -> None:
    """A lorry on nearly all of a long pavement leaves one end; one on all of it leaves none."""
    area = StartingArea(Polyline([(0.0, 0.0), (2000.0, 0.0)]), 0.0, 2000.0, 2.0, ("edge",))
    starts = draw_starts([area], [PEDESTRIAN], np.random.default_rng(1))
    long = Box(1003.0, 0.0, 0.0, 1996.0, 3.0)
    (start,) = clear_starts([area], [PEDESTRIAN], starts, [long], np.random.default_rng(1))
    assert (start.x, start.y) == (pytest.approx(PEDESTRIAN.reach), 0.0)
    over = Box(1000.0, 0.0, 0.0, 2100.0, 3.0)
    with pytest.raises(NetworkError, match="no room for tester0 on the pavements"):
        clear_starts([area], [PEDESTRIAN], starts, [over], np.random.default_rng(1))


def test_nobody_starts_in_a_car_that_stands_in_sumo(staged: Staged, tmp_path: Path) -> None:
    """A car is parked where testers may start here; only who would start in it is moved."""
    plan, bare = staged()
    lane = read_network(bare.net).edges[-1].getLanes()[-1]
    routes = tmp_path / "parked.rou.xml"
    routes.write_text(
        f'<routes><route id="r" edges="{lane.getEdge().getID()}"/>'
        f'<vehicle id="parked" route="r" depart="0" departLane="{lane.getIndex()}" departPos="50">'
        f'<stop lane="{lane.getID()}" endPos="50.1" duration="1000"/></vehicle></routes>'
    )
    plan, site = staged(routes=str(routes), agents=["timing"], runs=12)
    axis = Polyline(lane_shape(lane))
    area = StartingArea(axis, 40.0, 58.0, 3.0, ())
    moved = 0
    with EpisodeRunner(prepared_at(plan, dataclasses.replace(site, areas=(area,)))) as runner:
        for run in range(plan.runs):
            one = job(plan, run)
            first = EpisodeLoop(runner.setup, runner.agents_of(one), one.seed, record=True)
            (car,) = first.snapshot.background
            rooms = [room(s, PEDESTRIAN) for s in first.scene.starts]
            assert all(is_clear(box, [car.box]) for box in rooms)
            for state, start in zip(first.snapshot.testers, first.scene.starts, strict=True):
                assert (state.x, state.y, state.o) == (start.x, start.y, start.o)
            drawn = draw_starts([area], TRIO, starts_generator(one.seed))
            moved += drawn != first.scene.starts
    assert 0 < moved < plan.runs


@ALL
def test_starts_are_seeded_and_differ(staged: Staged, name: str) -> None:
    """The same generator gives the same starts; episodes use all areas and both directions."""
    site: Site = staged(name)[1]
    all_starts = [s for trio in draws(site) for s in trio]
    assert all_starts == [s for trio in draws(site) for s in trio]
    assert {s.forwards for s in all_starts} == {True, False}
    long_enough = [a.pavement for a in site.areas if a.end - a.begin > 10.0]
    assert all(any(s.pavement is p for s in all_starts) for p in long_enough)


@pytest.mark.parametrize("kind", [PEDESTRIAN, KINDS["bicycle"]], ids=lambda k: k.name)
def test_starts_are_spread_evenly_over_the_pavement(kind: Kind) -> None:
    """Uniform along and across: the middle half of a pavement gets half of the starts."""
    area = StartingArea(Polyline([(0.0, 0.0), (100.0, 0.0)]), 0.0, 100.0, 4.0, ("edge",))
    rng = np.random.default_rng(5)
    starts = [draw_starts([area], [kind], rng)[0] for _ in range(2000)]
    margin = kind.reach
    middle = sum(25.0 < s.x < 75.0 for s in starts) / 2000
    assert middle == pytest.approx(50.0 / (100.0 - 2 * margin), abs=0.04)
    assert max(abs(s.y) for s in starts) <= 2.0 - margin
    assert sum(s.y > 0 for s in starts) / 2000 == pytest.approx(0.5, abs=0.04)


def test_long_pavements_get_more_starts_than_short_ones() -> None:
    """In proportion to their surface: 90 m against 10 m of equal width."""
    axes = [Polyline([(0.0, 0.0), (90.0, 0.0)]), Polyline([(0.0, 50.0), (10.0, 50.0)])]
    areas = [StartingArea(axis, 0.0, axis.length, 3.0, ("edge",)) for axis in axes]
    rng = np.random.default_rng(5)
    starts = [draw_starts(areas, [PEDESTRIAN], rng)[0] for _ in range(1000)]
    on_the_long_one = sum(s.pavement is axes[0] for s in starts) / 1000
    assert on_the_long_one == pytest.approx(0.9, abs=0.04)


def test_more_testers_than_fit_are_refused() -> None:
    """Twenty pedestrians on five metres of pavement: one sentence, no endless search."""
    area = StartingArea(Polyline([(0.0, 0.0), (5.0, 0.0)]), 0.0, 5.0, 2.0, ("edge",))
    with pytest.raises(NetworkError, match="no room for 20 testers"):
        draw_starts([area], [PEDESTRIAN] * 20, np.random.default_rng(1))


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(
            "crossing",
        ),
        "junction",
    ],
)
def test_persons_are_said_to_walk_over_real_edges(
    staged: Staged, networks: dict[str, Path], name: str
) -> None:
    """The walk that SUMO believes leads over edges with pavements, never ends inside a junction."""
    edges = {e.getID() for e in read_network(networks[name]).edges}
    for area in staged(name)[1].areas:
        assert len(area.walk) == 2
        assert set(area.walk) <= edges
