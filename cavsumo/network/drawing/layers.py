"""A junction's picture, layer by layer: the place, the ego's routes, where testers start."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import cache
from typing import Any

import shapely
from matplotlib import font_manager
from matplotlib.axes import Axes
from matplotlib.ft2font import FT2Font
from matplotlib.patches import FancyArrowPatch, PathPatch
from matplotlib.path import Path as Outline
from matplotlib.patheffects import withStroke
from shapely.geometry import LineString, Polygon

from cavsumo.model.polyline import Path as Polyline
from cavsumo.network.drawing.place import COLOURS, DrawnPlace, StreetName, View
from cavsumo.network.drawing.surfaces import beside
from cavsumo.network.inspection import Way

TURNS = {"straight": "#1b7837", "left": "#2166ac", "right": "#d6604d", "u-turn": "#762a83"}
AREA, AREA_EDGE = "#f5b301", "#a87400"
HEIGHTS = {"road": 1.0, "other": 2.0, "pavement": 2.0, "walking": 3.0, "stripes": 4.0}
STROKES: dict[str, dict[str, Any]] = {
    "solid": {"lw": 0.7, "zorder": 2.5},
    "dashed": {"lw": 0.7, "ls": (0, (6, 6)), "zorder": 2.5},
    "borders": {"lw": 1.6, "ls": (0, (1.2, 0.8)), "zorder": 4},
}
SIGNAL_DOTS: dict[str, Any] = {
    "marker": "o",
    "ms": 5,
    "color": "#d7191c",
    "mec": "white",
    "mew": 0.8,
}
BOXES = "Last Resort"  # fonts that have a box for every letter
LETTER = 0.0075  # width of a letter of a street's name, as part of the picture's height
BESIDE_M = {"straight": 0.0, "left": 0.5, "right": -0.5, "u-turn": 1.0}  # routes are drawn apart


# The place


def draw_place(axes: Axes, place: DrawnPlace, view: View) -> None:
    """Surfaces, the lines on them, crossings with dots at signals, street names."""
    seen = place.within(view)
    for role, height in HEIGHTS.items():
        _fill(axes, seen.areas[role], COLOURS[role], height)
    for role, style in STROKES.items():
        for points in seen.lines[role]:
            axes.plot(*zip(*points, strict=True), color=COLOURS[role], **style)
    if place.signals:
        axes.plot(*zip(*place.signals, strict=True), ls="", **SIGNAL_DOTS, zorder=6)
    _draw_names(axes, place.names, shapely.box(*view))


def _draw_names(axes: Axes, names: Sequence[StreetName], window: shapely.Geometry) -> None:
    """Each street's name, where most of it is seen."""
    best: dict[str, LineString] = {}
    letter_m = LETTER * (window.bounds[3] - window.bounds[1])
    for name, along in names:
        line = _longest(along.intersection(window))
        if line is None or line.length <= letter_m * len(name):
            continue
        if font_for(name) and line.length > getattr(best.get(name), "length", 0):
            best[name] = line
    for name, line in best.items():
        where, ahead = line.interpolate(line.length / 2), line.interpolate(line.length / 2 + 1.0)
        angle = math.degrees(math.atan2(ahead.y - where.y, ahead.x - where.x))
        text = axes.text(where.x, where.y, name, color="#222222", zorder=9, font=font_for(name))
        text.set_fontsize(8)
        text.set(rotation=(angle + 90) % 180 - 90, ha="center", va="center", rotation_mode="anchor")
        text.set_path_effects([withStroke(linewidth=2.5, foreground="white", alpha=0.8)])


def _longest(shape: shapely.Geometry) -> LineString | None:
    """The longest piece of what is left of a line."""
    lines = [part for part in getattr(shape, "geoms", [shape]) if part.geom_type == "LineString"]
    return max(lines, key=lambda line: line.length, default=None)


def _fill(
    axes: Axes, rings: Iterable[Sequence[Any]], color: str, height: float, **style: Any
) -> None:
    """Fill polygons as one patch, each ring anticlockwise, so that none is a hole of another."""
    outline = [
        Outline(shapely.geometry.polygon.orient(Polygon(ring)).exterior.coords, closed=True)
        for ring in rings
    ]
    if outline:
        path = Outline.make_compound_path(*outline)
        axes.add_patch(PathPatch(path, **{"facecolor": color, "lw": 0, "zorder": height} | style))


# The test


def draw_areas(axes: Axes, ways: Sequence[Way]) -> None:
    """The stretches of pavement where testers start, of all routes together."""
    everywhere = shapely.union_all(
        [
            LineString(a.pavement.cut(a.begin, a.end).points).buffer(a.width / 2, cap_style="flat")
            for way in ways
            for a in way.areas
        ]
    )
    rings = [part.exterior.coords for part in getattr(everywhere, "geoms", [everywhere])]
    style = {"alpha": 0.75, "hatch": "////", "edgecolor": AREA_EDGE, "lw": 0.5}
    _fill(axes, [ring for ring in rings if len(ring) > 0], AREA, 5, **style)


def draw_routes(axes: Axes, ways: Sequence[Way]) -> None:
    """The ego's routes, side by side, the best one widest and on top, arrows at their ends."""
    for rank, way in reversed(list(enumerate(ways))):
        line = LineString(way.route.path.points)
        shown = beside(line, BESIDE_M[way.turn]) or line
        path = Polyline(shown.coords)
        color, wide, z = TURNS[way.turn], *((3.4, 8.0) if rank == 0 else (1.5, 7.0))
        axes.plot(*shown.xy, color=color, lw=wide, zorder=z, solid_joinstyle="round")
        axes.plot(*path.points[0], "o", color=color, ms=2 + 1.5 * wide, zorder=z)
        tail, tip = path.at(path.length - 0.5)[:2], path.at(path.length + 3.0)[:2]
        arrow = FancyArrowPatch(tail, tip, arrowstyle="-|>", mutation_scale=8 + 3 * wide)
        arrow.set(color=color, zorder=z, lw=wide)
        axes.add_patch(arrow)


@cache
def font_for(text: str) -> font_manager.FontProperties | None:
    """A font that can write a text, the usual one if it can; without its letters boxes are seen."""
    usual = font_manager.FontProperties()
    if _can_write(font_manager.findfont(usual), text):
        return usual
    entries = font_manager.fontManager.ttflist
    files = sorted({entry.fname for entry in entries if BOXES not in entry.name})
    able = (file for file in files if _can_write(file, text))
    return next((font_manager.FontProperties(fname=file) for file in able), None)


def _can_write(file: str, text: str) -> bool:
    """Whether a font has all letters of a text."""
    try:
        return set(map(ord, text)) <= _letters(file)
    except (OSError, RuntimeError):  # one that was removed, or is damaged
        return False


@cache
def _letters(file: str) -> frozenset[int]:
    """The letters of a font."""
    return frozenset(FT2Font(file).get_charmap())
