"""The network of an episode for the page: surfaces, lines, the lights on the ego's way."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import shapely
from shapely.geometry import LineString

from cavsumo.network.drawing import surfaces
from cavsumo.network.facts import PRIORITY
from cavsumo.network.reader import Network
from cavsumo.network.site import Site
from cavsumo.report.pages.replay.packing import CENTI, columns, shapes

ALIKE_M = 0.03  # outlines are simplified by this much
STOP_LINE_M = 3.2  # width of a drawn stop line

View = tuple[float, float, float, float]  # west, south, east, north [m]


class Outlines(NamedTuple):
    """The outlines of a network by kind, in the order of drawing.

    Attributes:
        areas, lines: their points [m]; those of an area go round it.
    """

    areas: dict[str, list[list[Any]]]
    lines: dict[str, list[list[Any]]]


def scenery(network: Network, site: Site, view: View) -> dict[str, Any]:
    """The outlines of a network within a view, packed."""
    ground = outlines(network, site, view)
    return {
        "areas": {name: shapes(found) for name, found in ground.areas.items()},
        "lines": {name: shapes(found) for name, found in ground.lines.items()},
        "lights": _lights(site),
        "credit": surfaces.credit(network.file),
    }


def outlines(network: Network, site: Site, view: View) -> Outlines:
    """The outlines of a network within a view."""
    lanes = surfaces.lanes_by_kind(network)
    borders, stripes = _crossings(network)
    lines = list(surfaces.markings(network))
    areas = {
        "road": [*surfaces.junctions(network), *lanes[surfaces.ROAD]],
        "other": lanes[surfaces.OTHER],
        "pavement": lanes[surfaces.PAVEMENT],
        "walking": surfaces.walking_areas(network),
        "stripes": stripes,
    }
    strokes = {
        "solid": [line for line, solid in lines if solid],
        "dashed": [line for line, solid in lines if not solid],
        "borders": borders,
        "route": [LineString(site.route.path.points)],
    }
    return Outlines(
        {name: _rings(found, view) for name, found in areas.items()},
        {name: _lines(found, view) for name, found in strokes.items()},
    )


def _crossings(network: Network) -> tuple[list[LineString], list[shapely.Geometry]]:
    """The crossings: two lines each, or a zebra's stripes where pedestrians have priority."""
    borders: list[LineString] = []
    stripes: list[shapely.Geometry] = []
    for axis, half, right in surfaces.crossings(network):
        if right == PRIORITY:
            stripes += surfaces.stripes(axis, half)
        else:
            both = (surfaces.beside(axis, half), surfaces.beside(axis, -half))
            borders += [line for line in both if line is not None]
    return borders, stripes


def _lights(site: Site) -> str:
    """The stop lines of the ego's lights: their two ends, x and y each [cm]."""
    rows = []
    for light in site.lights:
        x, y, o = site.route.path.at(light.along)
        across_x, across_y = -math.sin(o) * STOP_LINE_M / 2, math.cos(o) * STOP_LINE_M / 2
        rows.append((x + across_x, y + across_y, x - across_x, y - across_y))
    return columns(rows, [CENTI] * 4)


def _rings(found: Iterable[shapely.Geometry], view: View) -> list[list[Any]]:
    """The outlines of areas, as far as they are in view."""
    return [list(part.exterior.coords)[:-1] for part in _parts(found, view, "Polygon")]


def _lines(found: Iterable[shapely.Geometry], view: View) -> list[list[Any]]:
    """The points of lines, as far as they are in view."""
    return [list(part.coords) for part in _parts(found, view, "LineString")]


def _parts(found: Iterable[shapely.Geometry], view: View, sort: str) -> list[Any]:
    """The parts of shapes in view; shapes that shapely cannot cut are left whole."""
    kept = []
    for shape in found:
        simple = shape.simplify(ALIKE_M)
        cut = shapely.clip_by_rect(simple, *view) if simple.is_valid else simple
        parts = getattr(cut, "geoms", [cut])
        kept += [part for part in parts if part.geom_type == sort and not part.is_empty]
    return kept
