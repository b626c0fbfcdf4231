"""The lanes and pavements near the ego's route, as an ego that plans its path needs them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import shapely
from shapely.geometry import LineString

from cavsumo.model.surroundings import LaneBorders, Points, RouteLane, Surroundings
from cavsumo.network.drawing.surfaces import beside, walking_areas
from cavsumo.network.ego_routes import EgoRoute, lanes_along
from cavsumo.network.reader import Network, driving_lanes, lane_areas, lane_shape

REACH_M = 20.0  # lanes and pavements are told so far from the route
COARSE_M = 0.05  # how far a told outline may deviate from the network's


def surroundings(network: Network, route: EgoRoute) -> Surroundings:
    """The road within ``REACH_M`` of a route."""
    path = LineString(route.path.points)
    passed = lanes_along(network, [network.edge(edge) for edge in route.edges]) or []
    others = [lane for edge in network.edges for lane in driving_lanes(edge)]
    lanes = {lane.getID(): lane for lane in (*passed, *others)}.values()
    footways = lane_areas(network.pavements_near(path, REACH_M))
    outlines = shapely.make_valid([*footways, *walking_areas(network)])
    return Surroundings(
        route_lanes(network, route),
        tuple(borders for lane in _near(lanes, path) if (borders := _borders(lane))),
        tuple(_outlines(outlines, path)),
    )


def route_lanes(network: Network, route: EgoRoute) -> tuple[RouteLane, ...]:
    """The lanes of a route in order, without those that end before its path begins."""
    lanes = lanes_along(network, [network.edge(edge) for edge in route.edges])
    assert lanes is not None  # or it were no route
    found: list[RouteLane] = []
    for lane in lanes:
        along = route.path.project(*lane.getShape()[0][:2]).along if found else 0.0
        while found and found[-1].along >= along:
            found.pop()
        found.append(RouteLane(along, float(lane.getWidth()), float(lane.getSpeed())))
    return tuple(found)


def _near(lanes: Iterable[Any], path: LineString) -> list[Any]:
    """The lanes whose axis comes near a path."""
    kept = [lane for lane in lanes if len(lane.getShape()) > 1]
    near = shapely.dwithin([LineString(lane_shape(lane)) for lane in kept], path, REACH_M)
    return [lane for lane, it_is in zip(kept, near.tolist(), strict=True) if it_is]


def _borders(lane: Any) -> LaneBorders | None:
    """The borders of a lane; None for one so narrow or bent that it has none."""
    axis, half = LineString(lane_shape(lane)), float(lane.getWidth()) / 2
    left, right = beside(axis, half), beside(axis, -half)
    if left is None or right is None:
        return None
    return LaneBorders(str(lane.getID()), _points(left.coords), _points(right.coords))


def _outlines(areas: Sequence[shapely.Geometry], path: LineString) -> Iterable[Points]:
    """The outlines of the areas near a path."""
    for area in areas:
        if shapely.dwithin(area, path, REACH_M):
            for part in getattr(area.simplify(COARSE_M), "geoms", [area.simplify(COARSE_M)]):
                if part.geom_type == "Polygon" and not part.is_empty:
                    yield _points(part.exterior.coords)[:-1]


def _points(coordinates: Iterable[Any]) -> Points:
    """Points to the millimetre."""
    return tuple((round(p[0], 3), round(p[1], 3)) for p in coordinates)
