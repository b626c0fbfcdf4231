"""What is drawn of a place: one record, of which every picture takes the same outlines."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

import pytest
import shapely
from shapely.geometry import LineString, Polygon

from cavsumo.network.drawing.place import COLOURS, DrawnPlace, site_drawn
from cavsumo.network.site import Site
from cavsumo.report.pages.replay.packing import unpacked
from cavsumo.report.pages.replay.scenery import scenery

Staged = Callable[..., tuple[Any, Site]]


@pytest.fixture(scope="module")
def junction(staged: Staged) -> tuple[Site, DrawnPlace]:
    """The junction with traffic lights, and what is drawn of it."""
    _, site = staged("junction")
    return site, site_drawn(site)


def around(site: Site, half: float) -> tuple[float, float, float, float]:
    """A square in the middle of the ego's route."""
    x, y, _ = site.route.path.at(site.route.path.length / 2)
    return x - half, y - half, x + half, y + half


def test_each_role_is_where_it_is_on_the_network(junction: tuple[Site, DrawnPlace]) -> None:
    """Carriageways are the site's, lines and the route lie on them, pavements beside."""
    site, place = junction
    road = shapely.union_all(place.areas["road"])
    lanes = site.roads.carriageway
    assert lanes.difference(road.buffer(0.1)).area < 0.02 * lanes.area
    for role in ("solid", "dashed", "borders", "route"):
        for line in place.lines[role]:
            assert line.difference(road.buffer(0.3)).length < 0.02 * line.length, role
    pavements = shapely.union_all(place.areas["pavement"])
    assert pavements.area > 100.0
    assert pavements.intersection(road).area < 0.02 * pavements.area
    assert set(COLOURS) == {*place.areas, *place.lines}


def test_stop_lines_lie_across_the_route_in_the_order_of_its_lights(
    junction: tuple[Site, DrawnPlace],
) -> None:
    """One for each light, centred on the path."""
    site, place = junction
    assert len(place.stops) == len(site.lights) > 0
    for stop, light in zip(place.stops, site.lights, strict=True):
        x, y, o = site.route.path.at(light.along)
        (left_x, left_y), (right_x, right_y) = stop.coords
        assert ((left_x + right_x) / 2, (left_y + right_y) / 2) == pytest.approx((x, y))
        assert math.cos(math.atan2(left_y - right_y, left_x - right_x) - o) == pytest.approx(0.0)


def test_what_is_out_of_view_is_cut_off(junction: tuple[Site, DrawnPlace]) -> None:
    """Every outline lies in the view, and a small view has less than a large one."""
    site, place = junction
    view = around(site, 15.0)
    frame = shapely.box(*view).buffer(1e-6)
    seen = place.within(view)
    assert all(Polygon(ring).within(frame) for rings in seen.areas.values() for ring in rings)
    assert all(LineString(part).within(frame) for parts in seen.lines.values() for part in parts)
    whole = place.within(around(site, 500.0))
    area = {
        name: sum(Polygon(ring).area for rings in part.areas.values() for ring in rings)
        for name, part in (("seen", seen), ("whole", whole))
    }
    assert 0.0 < area["seen"] < 0.5 * area["whole"]


def test_the_page_is_given_the_outlines_of_the_place(junction: tuple[Site, DrawnPlace]) -> None:
    """In centimetres, role by role."""
    site, place = junction
    view = around(site, 40.0)
    seen, packed = place.within(view), scenery(place, view)
    assert list(packed["areas"]) == list(seen.areas)
    assert list(packed["lines"]) == list(seen.lines)
    for role, parts in (*seen.areas.items(), *seen.lines.items()):
        data = (packed["areas"] | packed["lines"])[role]
        assert unpacked(data["sizes"]) == [len(part) for part in parts]
        xs = [round(100.0 * point[0]) for part in parts for point in part]
        assert unpacked(data["points"])[: len(xs)] == xs
    assert packed["credit"] == place.credit
    assert re.search("OpenStreetMap", place.credit)


def test_dashes_of_a_picture_lie_still_on_the_road(junction: tuple[Site, DrawnPlace]) -> None:
    """They are parts of the line, as long as the gaps between them."""
    pytest.importorskip("PIL")
    from cavsumo.envs.painting import DASHES_M, _dashed

    _, place = junction
    (route,) = place.lines["route"]
    (dashes,) = _dashed(place).lines["route"]
    assert dashes.difference(route.buffer(1e-6)).is_empty
    assert dashes.length == pytest.approx(route.length / 2, abs=DASHES_M["route"])
    starts = [route.project(shapely.Point(part.coords[0])) for part in dashes.geoms]
    assert starts == pytest.approx([2 * DASHES_M["route"] * i for i in range(len(starts))])
