"""The surfaces of a network as shapes, for drawing: lanes, junctions, crossings, lines."""

from __future__ import annotations

import gzip
from collections.abc import Iterator
from pathlib import Path as FilePath
from typing import Any, NamedTuple

import shapely
from shapely.geometry import LineString, Polygon

from cavsumo.model.polyline import Path
from cavsumo.network.facts import right_of_way
from cavsumo.network.reader import Network, is_pavement, lane_areas, lane_shape

ROAD, OTHER, PAVEMENT = "road", "other", "pavement"  # lanes for cars, for others, for pedestrians
STRIPE_M = 0.5  # width of a zebra's stripe, and of the gap behind it
OSM = "Map data © OpenStreetMap contributors, ODbL"


class Marked(NamedTuple):
    """A pedestrian crossing: its axis, half its width [m] and what gives pedestrians their turn."""

    axis: LineString
    half: float
    right: str


def junctions(network: Network) -> list[Polygon]:
    """The areas of the junctions."""
    return _polygons(node.getShape() for node in network.net.getNodes())


def walking_areas(network: Network) -> list[Polygon]:
    """Where pavements and crossings meet."""
    return _polygons(e.getLanes()[0].getShape() for e in network.inside("walkingarea"))


def lanes_by_kind(network: Network) -> dict[str, list[shapely.Geometry]]:
    """The surfaces of all lanes outside junctions, by kind."""
    lanes = [lane for edge in network.edges for lane in edge.getLanes()]
    found: dict[str, list[shapely.Geometry]] = {ROAD: [], OTHER: [], PAVEMENT: []}
    for lane, surface in zip(lanes, lane_areas(lanes), strict=True):
        found[lane_kind(lane)].append(surface)
    return found


def lane_kind(lane: Any) -> str:
    """The kind of a lane by its users."""
    if is_pavement(lane):
        return PAVEMENT
    return ROAD if lane.allows("passenger") else OTHER


def markings(network: Network) -> Iterator[tuple[LineString, bool]]:
    """The lines on the roads, and whether each is solid.

    Dashes between the lanes of an edge, a line on the side of oncoming traffic.
    """
    side = -1.0 if network.left_hand else 1.0  # of a lane on which the next one lies
    for edge in network.edges:
        lanes = [lane for lane in edge.getLanes() if not is_pavement(lane)]
        for lane in lanes:
            border = beside(LineString(lane_shape(lane)), side * lane.getWidth() / 2)
            if border is not None:
                yield border, lane is lanes[-1]


def crossings(network: Network) -> Iterator[Marked]:
    """The pedestrian crossings."""
    for crossing in network.crossings():
        lane = crossing.getLanes()[0]
        half = float(lane.getWidth()) / 2
        yield Marked(LineString(lane_shape(lane)), half, right_of_way(crossing))


def stripes(axis: LineString, half: float) -> list[shapely.Geometry]:
    """The stripes of a zebra crossing, along the road that it crosses."""
    line = Path(axis.coords)
    starts = [i * 2 * STRIPE_M for i in range(int(line.length / (2 * STRIPE_M)) + 1)]
    return [
        LineString(line.cut(s, min(line.length, s + STRIPE_M)).points).buffer(
            half, cap_style="flat"
        )
        for s in starts
        if line.length - s > 0.05
    ]


def beside(axis: LineString, offset: float) -> LineString | None:
    """The line beside an axis, on its left for a positive offset [m]; None where it vanishes."""
    line = axis.offset_curve(offset)
    return None if line.is_empty or line.geom_type != "LineString" else line


def credit(file: FilePath) -> str:
    """The attribution of a network that was made from OpenStreetMap's data, else empty."""
    opener = gzip.open if file.suffix == ".gz" else open
    with opener(file, "rb") as stream:
        return OSM if b"OpenStreetMap" in stream.read(4096) else ""


def _polygons(shapes: Iterator[Any]) -> list[Polygon]:
    """Outlines as polygons, where there are enough points."""
    return [Polygon([p[:2] for p in shape]) for shape in shapes if len(shape) > 2]
