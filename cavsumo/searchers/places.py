"""Places where bodies of a test can start, relative to the ego's path."""

from __future__ import annotations

from typing import NamedTuple

from cavsumo.model.carriageway import Start

NEAREST_M = 12.0  # nearer to where the ego enters nobody can meet it in time


class Place(NamedTuple):
    """A place where a body can start.

    Attributes:
        start: there.
        left: whether it comes from the left of the ego.
        along: where its way meets the ego's path [m].
        away: how far it is from the strip that the ego sweeps [m].
    """

    start: Start
    left: bool
    along: float
    away: float = 0.0


def within(bounds: tuple[float, float], share: float) -> float:
    """The number at a share of an interval."""
    return bounds[0] + share * (bounds[1] - bounds[0])
