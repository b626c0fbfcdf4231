"""A junction drawn from above: lanes, crossings, the ego's routes, where testers start.

Needs matplotlib; draws into a file, never on a screen.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import shapely
from matplotlib import font_manager
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ft2font import FT2Font
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch, Patch, PathPatch
from matplotlib.path import Path as Outline
from shapely.geometry import LineString, Polygon

from cavsumo.errors import InputError
from cavsumo.facts import PRIORITY, SIGNALS, right_of_way
from cavsumo.inspection import Ground, Junction, Way
from cavsumo.network import is_pavement, lane_areas, lane_shape
from cavsumo.paths import Path as Polyline

Box = tuple[float, float, float, float]  # west, south, east, north [m]

MARGIN_M = 12.0  # around the routes
HEIGHT_IN, DPI = 9.0, 150
STRIPE_M = 0.5  # width of a zebra's stripe, and of the gap behind it
GROUND, ROAD, OTHER, PAVEMENT, WALKING = "#eef1ea", "#8b9096", "#b49a7c", "#d9d4c7", "#c9c2b0"
TURNS = {"straight": "#1b7837", "left": "#2166ac", "right": "#d6604d", "u-turn": "#762a83"}
AREA = "#f5b301"
CROSSINGS = {SIGNALS: "#ffffff", PRIORITY: "#ffffff", "none": "#e3e6e8"}


def draw(here: Ground, junction: Junction | None, file: Path) -> None:
    """Draw a junction, or the whole network when there is none; raises InputError."""
    ways = junction.ways if junction else ()
    view = _view(here, ways)
    ratio = min(2.0, max(0.7, (view[2] - view[0]) / (view[3] - view[1])))
    figure = Figure(figsize=(HEIGHT_IN * ratio, HEIGHT_IN), dpi=DPI, layout="constrained")
    axes = figure.add_subplot()
    axes.set(xlim=view[::2], ylim=view[1::2], aspect="equal", xticks=[], yticks=[])
    axes.set_facecolor(GROUND)
    _draw_surfaces(axes, here, view)
    _draw_crossings(axes, here, view)
    _draw_areas(axes, ways)
    _draw_routes(axes, ways)
    _draw_scale(axes, view)
    axes.set_title(_title(here, junction), fontsize=12)
    axes.legend(
        handles=_legend(here, ways), loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False
    )
    try:
        figure.savefig(file, metadata={"Date": None} if file.suffix in (".svg", ".pdf") else None)
    except OSError as error:
        raise InputError(f"--picture {str(file)!r}: {error.strerror}") from error
