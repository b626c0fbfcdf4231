"""Starts to be recorded and found again on the same site: plain data there and back."""

from __future__ import annotations

from collections.abc import Sequence

from cavsumo.errors import InputError
from cavsumo.model.carriageway import Start, StartRecord
from cavsumo.network.site import Site


def start_record(site: Site, start: Start) -> StartRecord:
    """A start that was drawn on a site, as plain data."""
    if start.approach is not None:
        place, edges = _number(site.approaches, start.approach), start.approach.edges
    else:
        pavements = [area.pavement for area in site.areas]
        place, edges = _number(pavements, start.pavement), start.walk
    return StartRecord(
        start.x, start.y, start.o, start.v, place, start.lateral, start.forwards, edges
    )


def recorded_start(site: Site, record: StartRecord) -> Start:
    """The start that was recorded; raises InputError when it was on another site."""
    x, y, o, v, place, lateral, forwards, edges = record
    if place is None:
        return Start(x, y, o, walk=edges, v=v)
    if site.approaches:
        approach = site.approaches[place] if 0 <= place < len(site.approaches) else None
        if approach is not None and approach.edges == edges:
            return Start(x, y, o, approach=approach, v=v)
    else:
        area = site.areas[place] if 0 <= place < len(site.areas) else None
        if area is not None and area.walk == edges:
            return Start(x, y, o, area.pavement, lateral, forwards, area.walk, v=v)
    raise InputError(
        f"a tester started at {x:.1f}, {y:.1f} on place {place} ({' '.join(edges)}), which is "
        "another one here: the network or the version of cavsumo is not the recorded one"
    )


def _number(places: Sequence[object], wanted: object) -> int | None:
    """Which of the places it is; the very object, not an equal one."""
    return next((i for i, place in enumerate(places) if place is wanted), None)
