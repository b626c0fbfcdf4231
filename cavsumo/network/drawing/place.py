"""A place as it is drawn: one record for every picture of it.

The record has outlines in metres, by the role that each plays: made once, then written as a file's
picture (``picture``), as pixels, as the page's canvas, as SVG or as sumo-gui's polygons. A writer
chooses roles and styles, and never walks the network itself.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple

import shapely
from shapely.geometry import LineString

from cavsumo.model.carriageway import Light
from cavsumo.model.polyline import Path
from cavsumo.network.drawing import surfaces
from cavsumo.network.facts import PRIORITY, SIGNALS
from cavsumo.network.reader import Network, read_network, street
from cavsumo.network.site import Site

View = tuple[float, float, float, float]  # west, south, east, north [m]

ALIKE_M = 0.03  # outlines are simplified by this much
STOP_LINE_M = 3.2  # width of a drawn stop line

# Colours by role, for writers that have no style sheet.
GROUND = "#eef1ea"
COLOURS: Mapping[str, str] = MappingProxyType(
    {
        "pavement": "#d9d4c7",
        "other": "#b49a7c",
        "road": "#8b9096",
        "walking": "#c9c2b0",
        "stripes": "#ffffff",
        "borders": "#ffffff",
        "solid": "#ffffff",
        "dashed": "#ffffff",
        "route": "#1b7837",
    }
)


class Outlines(NamedTuple):
    """A part of a place, role by role.

    Attributes:
        areas, lines: their points [m]; those of an area go round it, the last is not the first.
    """

    areas: Mapping[str, list[list[Any]]]
    lines: Mapping[str, list[list[Any]]]


class StreetName(NamedTuple):
    """A street's name, and an edge of it along which it may be written."""

    text: str
    along: LineString


@dataclass(frozen=True)
class DrawnPlace:
    """What is drawn of a place [m].

    Attributes:
        areas: polygons: "road" (junctions and lanes for cars), "other" (lanes for others),
            "pavement", "walking" (areas where pavements and crossings meet), "stripes" (of zebra
            crossings).
        lines: "solid" and "dashed" markings between lanes, "borders" (two lines for a crossing that
            has no priority), "route" (the ego's, those of several in the order given).
        stops: the stop lines of the traffic lights on the ego's route, in their order.
        signals: both ends of every crossing at traffic lights.
        names: of streets, edge by edge.
        credit: whom the map's licence asks to name; empty for nobody.
    """

    areas: Mapping[str, Sequence[shapely.Geometry]]
    lines: Mapping[str, Sequence[shapely.Geometry]]
    stops: Sequence[LineString]
    signals: Sequence[tuple[float, float]]
    names: Sequence[StreetName]
    credit: str

    def within(self, view: View) -> Outlines:
        """The outlines that are in view, cut at its edges."""
        return Outlines(
            {role: _rings(self._seen(role, view)) for role in self.areas},
            {role: _strokes(self._seen(role, view)) for role in self.lines},
        )

    @cached_property
    def _indices(self) -> dict[str, shapely.STRtree]:
        """Where the shapes of each role are, as only few of a large network are in view."""
        return {
            role: shapely.STRtree(list(found))
            for role, found in {**self.areas, **self.lines}.items()
        }

    def _seen(self, role: str, view: View) -> Iterator[shapely.Geometry]:
        """The parts of a role's shapes that are in view; what shapely cannot cut is left whole."""
        index = self._indices[role]
        for i in sorted(index.query(shapely.box(*view))):
            shape = index.geometries[i]
            cut = shapely.clip_by_rect(shape, *view) if shape.is_valid else shape
            yield from getattr(cut, "geoms", [cut])


def site_drawn(site: Site) -> DrawnPlace:
    """The place of a site with its ego's route; raises NetworkError as ``read_network`` does."""
    return place_drawn(read_network(site.net), [site.route.path], site.lights)


def place_drawn(
    network: Network, routes: Sequence[Path], lights: Sequence[Light] = ()
) -> DrawnPlace:
    """A network as it is drawn, with routes of the ego; the lights are those on the first."""
    lanes, markings = surfaces.lanes_by_kind(network), list(surfaces.markings(network))
    crossings = list(surfaces.crossings(network))
    plain = [crossing for crossing in crossings if crossing.right != PRIORITY]
    areas = {
        "road": [*surfaces.junctions(network), *lanes[surfaces.ROAD]],
        "other": lanes[surfaces.OTHER],
        "pavement": lanes[surfaces.PAVEMENT],
        "walking": surfaces.walking_areas(network),
        "stripes": [
            stripe
            for axis, half, right in crossings
            if right == PRIORITY
            for stripe in surfaces.stripes(axis, half)
        ],
    }
    borders = [surfaces.beside(c.axis, side * c.half) for c in plain for side in (1, -1)]
    lines = {
        "solid": [line for line, solid in markings if solid],
        "dashed": [line for line, solid in markings if not solid],
        "borders": [line for line in borders if line is not None],
        "route": [LineString(path.points) for path in routes],
    }
    return DrawnPlace(
        {role: [shape.simplify(ALIKE_M) for shape in found] for role, found in areas.items()},
        {role: [line.simplify(ALIKE_M) for line in found] for role, found in lines.items()},
        stops=[_stop_line(routes[0], light) for light in lights],
        signals=[c.axis.coords[end][:2] for c in plain if c.right == SIGNALS for end in (0, -1)],
        names=[
            StreetName(name, LineString(edge.getShape()))
            for edge in network.edges
            if (name := street(edge))
        ],
        credit=surfaces.credit(network.file),
    )


def _stop_line(path: Path, light: Light) -> LineString:
    """The stop line of a traffic light, from left to right."""
    x, y, o = path.at(light.along)
    across_x, across_y = -math.sin(o) * STOP_LINE_M / 2, math.cos(o) * STOP_LINE_M / 2
    return LineString([(x + across_x, y + across_y), (x - across_x, y - across_y)])


def _rings(parts: Iterable[shapely.Geometry]) -> list[list[Any]]:
    """The outlines of areas."""
    return [
        list(p.exterior.coords)[:-1] for p in parts if p.geom_type == "Polygon" and not p.is_empty
    ]


def _strokes(parts: Iterable[shapely.Geometry]) -> list[list[Any]]:
    """The points of lines."""
    return [list(p.coords) for p in parts if p.geom_type == "LineString" and not p.is_empty]
