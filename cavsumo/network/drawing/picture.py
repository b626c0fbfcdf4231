"""A junction drawn from above: lanes, crossings, the ego's routes, where testers start.

Needs matplotlib; draws into a file, never on a screen.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import shapely
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from cavsumo.errors import InputError
from cavsumo.network.drawing.layers import (
    AREA,
    AREA_EDGE,
    SIGNAL_DOTS,
    TURNS,
    draw_areas,
    draw_place,
    draw_routes,
    font_for,
)
from cavsumo.network.drawing.place import COLOURS, GROUND, DrawnPlace, View, place_drawn
from cavsumo.network.facts import NONE, PRIORITY, SIGNALS, right_of_way
from cavsumo.network.inspection import InspectedNetwork, Junction, Way

MARGIN_M = 12.0  # around the routes
HEIGHT_IN, DPI = 9.0, 150
CROSSING_LABELS = {
    SIGNALS: "crossings at traffic lights",
    PRIORITY: "crossings with priority",
    NONE: "crossings without priority",
}
SURFACE_LABELS = {
    "road": "lanes for cars",
    "other": "other lanes",
    "pavement": "pavements",
    "walking": "walking areas",
}


def draw(here: InspectedNetwork, junction: Junction | None, file: Path) -> list[str]:
    """Draw a junction, or the whole network when there is none; raises InputError.

    Returns the names of its streets that no font here can write.
    """
    ways = junction.ways if junction else ()
    place = place_drawn(here.network, [way.route.path for way in ways])
    view = _view(place)
    ratio = min(2.0, max(0.7, (view[2] - view[0]) / (view[3] - view[1])))
    figure = Figure(figsize=(HEIGHT_IN * ratio, HEIGHT_IN), dpi=DPI)
    axes = figure.add_subplot()
    axes.set(xlim=view[::2], ylim=view[1::2], aspect="equal", xticks=[], yticks=[])
    axes.set_facecolor(GROUND)
    draw_place(axes, place, view)
    draw_areas(axes, ways)
    draw_routes(axes, ways)
    _draw_scale(axes, view)
    if place.credit:
        axes.text(
            0.995, 0.01, place.credit, transform=axes.transAxes, ha="right", fontsize=7, zorder=11
        )
    title, name = _titles(here, junction)
    axes.set_title(f"{title}\n", loc="left", font=font_for(title), size=13)
    axes.text(0, 1.012, name, transform=axes.transAxes, fontsize=8, color="#444444")
    axes.legend(
        handles=_legend(here, place, ways),
        loc="upper left",
        bbox_to_anchor=(1.0, 1.0),
        frameon=False,
    )
    dated = file.suffix.lower() in (".svg", ".pdf")  # the same picture is the same bytes
    metadata = {"Date" if file.suffix.lower() == ".svg" else "CreationDate": None} if dated else {}
    try:
        figure.savefig(file, bbox_inches="tight", pad_inches=0.15, metadata=metadata)
    except OSError as error:
        raise InputError(f"--picture {str(file)!r}: {error.strerror}") from error
    return [name for name in (junction.streets if junction else ()) if not font_for(name)]


def _view(place: DrawnPlace) -> View:
    """What to show: the routes and what lies around them, else the whole network."""
    lanes = [*place.areas["road"], *place.areas["other"], *place.areas["pavement"]]
    shown = place.lines["route"] or lanes
    west, south, east, north = shapely.total_bounds(shown).tolist()
    return west - MARGIN_M, south - MARGIN_M, east + MARGIN_M, north + MARGIN_M


def _draw_scale(axes: Axes, view: View) -> None:
    """A bar of a round length, about a fifth of the picture, in a corner."""
    wanted = (view[2] - view[0]) / 5
    unit = 10 ** math.floor(math.log10(wanted))
    length = max(step * unit for step in (1, 2, 5) if step * unit <= wanted)
    x, y = view[0] + 0.03 * (view[2] - view[0]), view[1] + 0.04 * (view[3] - view[1])
    tall = 0.006 * (view[3] - view[1])
    axes.fill(
        [x - tall, x + length + tall, x + length + tall, x - tall],
        [y - 2 * tall, y - 2 * tall, y + 5 * tall, y + 5 * tall],
        color="white",
        alpha=0.8,
        zorder=10,
    )
    axes.plot([x, x, x + length, x + length], [y + tall, y, y, y + tall], color="black", zorder=11)
    axes.text(x + length / 2, y + tall, f"{length:g} m", ha="center", va="bottom", zorder=11)


def _titles(here: InspectedNetwork, junction: Junction | None) -> tuple[str, str]:
    """The title, and a line below it: streets if they have names that can be written, and ids."""
    file = here.network.file.name
    if junction is None:
        return file, "the whole network"
    ids = f"junction {junction.id}"
    names = [name for name in junction.streets if font_for(name)]
    while names and not font_for(" / ".join(names)):  # each in a font of its own
        names.pop()
    return " / ".join(names) or ids, f"{ids}, {file}"


def _legend(here: InspectedNetwork, place: DrawnPlace, ways: Sequence[Way]) -> list[Any]:
    """What the colours mean, as far as they occur."""
    handles: list[Any] = []
    if ways:
        best = f"ego's best route ({ways[0].turn})"
        handles.append(Line2D([], [], color=TURNS[ways[0].turn], lw=3.4, label=best))
    for turn, color in TURNS.items():
        if any(way.turn == turn for way in ways):
            handles.append(
                Line2D([], [], color=color, lw=1.5, marker="o", ms=4, label=f"ego {turn}")
            )
    if any(way.areas for way in ways):
        label = "testers start here"
        handles.append(Patch(facecolor=AREA, hatch="////", edgecolor=AREA_EDGE, label=label))
    rights = {right_of_way(crossing) for crossing in here.network.crossings()}
    for right, label in CROSSING_LABELS.items():
        if right in rights:
            handles.append(_crossing_handle(right, label))
    return handles + [
        Patch(color=COLOURS[role], label=label)
        for role, label in SURFACE_LABELS.items()
        if place.areas[role]
    ]


def _crossing_handle(right: str, label: str) -> Any:
    """A crossing in the legend."""
    if right == PRIORITY:
        return Patch(facecolor=COLOURS["road"], hatch="|||", edgecolor="white", lw=0, label=label)
    if right == SIGNALS:
        style = {key: value for key, value in SIGNAL_DOTS.items() if key != "color"}
        return Line2D(
            [], [], lw=9, **style, mfc=SIGNAL_DOTS["color"], color=COLOURS["road"], label=label
        )
    return Line2D(
        [], [], lw=9, color=COLOURS["road"], marker="_", mec="white", mew=2, ms=14, label=label
    )
