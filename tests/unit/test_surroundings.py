"""The lanes and pavements near the ego's route."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
import shapely
from shapely.geometry import LineString, Polygon

from cavsumo.network.site import Site
from cavsumo.network.surroundings import REACH_M


@pytest.mark.parametrize("name", ["pedestrians", "crossing", "junction"])
def test_the_borders_of_the_routes_lanes_enclose_the_route(
    staged: Callable[..., Any], name: str
) -> None:
    """Every point of the centre line lies between the borders of some lane, left to its left."""
    site: Site = staged(name)[1]
    near = site.surroundings
    surfaces = shapely.union_all(
        [Polygon([*lane.left, *lane.right[::-1]]).buffer(0.01) for lane in near.lanes]
    )
    path = site.route.path
    for along in range(1, int(path.length)):
        x, y, _ = path.at(float(along))
        assert surfaces.covers(shapely.Point(x, y))
    first = near.lanes[0]
    middle = path.project(*first.left[0]).lateral, path.project(*first.right[0]).lateral
    assert middle[0] > 0.0 > middle[1]


@pytest.mark.parametrize("name", ["pedestrians", "crossing", "junction"])
def test_what_is_told_is_near_the_route(staged: Callable[..., Any], name: str) -> None:
    """Lanes and pavements within reach; the lanes of the route with width and limit, in order."""
    site: Site = staged(name)[1]
    near, path = site.surroundings, LineString(site.route.path.points)
    assert near.pavements
    for outline in near.pavements:
        assert Polygon(outline).distance(path) <= REACH_M + 0.1
    for lane in near.lanes:
        assert LineString(lane.left).distance(path) <= REACH_M + lane_width(lane.left, lane.right)
    starts = [lane.along for lane in near.route]
    assert starts == sorted(set(starts))
    assert starts[0] == 0.0
    assert near.route[0].speed == site.limits[0].speed
    assert all(3.0 <= lane.width <= 4.0 for lane in near.route)


def lane_width(left: Any, right: Any) -> float:
    """Distance between two borders [m]."""
    return float(LineString(left).distance(LineString(right)))
