"""The rules along the ego's route: its speed limits, the marked crossings that it drives over."""

from __future__ import annotations

from typing import Any

import shapely
from shapely.geometry import LineString, Point

from cavsumo.model.carriageway import Limit, MarkedCrossing
from cavsumo.network.ego_routes import EgoRoute
from cavsumo.network.reader import Network, lane_areas
from cavsumo.network.surroundings import route_lanes

PRIORITY = "M"  # SUMO's state of a link with priority


def limits_along(network: Network, route: EgoRoute) -> tuple[Limit, ...]:
    """The speed limits on the ego's path, in order; a lane with the limit of the last adds none."""
    found: list[Limit] = []
    for along, _, speed in route_lanes(network, route):
        if not found or found[-1].speed != speed:
            found.append(Limit(along, speed))
    return tuple(found)


def crossings_along(network: Network, route: EgoRoute) -> tuple[MarkedCrossing, ...]:
    """The marked crossings that the ego's path leads over, in order."""
    lanes = [edge.getLanes()[0] for edge in network.crossings()]
    path = LineString(route.path.points)
    shapely.prepare(path)
    found = []
    for lane, surface in zip(lanes, lane_areas(lanes), strict=True):
        if path.intersects(surface):
            ends = _ends(path, path.intersection(surface))
            found.append(_marked(lane.getEdge(), *ends, surface))
    return tuple(sorted(found, key=lambda crossing: (crossing.begin, crossing.id)))


def _marked(edge: Any, begin: float, end: float, surface: shapely.Geometry) -> MarkedCrossing:
    """A crossing with the network's right of way."""
    links = [link for way in edge.getIncoming().values() for link in way]
    lights = [(str(link.getTLSID()), int(link.getTLLinkIndex())) for link in links]
    light = next((light for light in lights if light[0]), None)
    priority = light is None and any(link.getState() == PRIORITY for link in links)
    return MarkedCrossing(str(edge.getID()), begin, end, surface, light, priority)


def _ends(path: LineString, shared: shapely.Geometry) -> tuple[float, float]:
    """Begin and end of the part of a path that lies on a surface [m]."""
    alongs = [path.project(Point(p)) for p in shapely.get_coordinates(shared)]
    return min(alongs), max(alongs)
