"""The network of an episode for the page: surfaces, lines, the lights on the ego's way."""

from __future__ import annotations

from typing import Any

from cavsumo.network.drawing.place import DrawnPlace, View
from cavsumo.report.pages.replay.packing import CENTI, columns, shapes


def scenery(place: DrawnPlace, view: View) -> dict[str, Any]:
    """What is drawn of a place within a view, packed.

    The stop lines are in "lights": their two ends, x and y each [cm].
    """
    seen = place.within(view)
    stops = [(*line.coords[0], *line.coords[-1]) for line in place.stops]
    return {
        "areas": {role: shapes(found) for role, found in seen.areas.items()},
        "lines": {role: shapes(found) for role, found in seen.lines.items()},
        "lights": columns(stops, [CENTI] * 4),
        "credit": place.credit,
    }
