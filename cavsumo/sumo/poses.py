"""Conversion between SUMO's poses and cavsumo's; the only place of it.

* cavsumo: the centre of the box [m], radians anticlockwise from east;
* SUMO: the middle of the front edge [m], degrees clockwise from north.
"""

from __future__ import annotations

import math

from cavsumo.errors import SimulationError
from cavsumo.model.snapshot import BodyState

RADIANS = math.pi / 180.0


def to_sumo(x: float, y: float, o: float, length: float) -> tuple[float, float, float]:
    """Centre and radians to the middle of the front edge and SUMO's degrees."""
    half = length / 2
    return x + half * math.cos(o), y + half * math.sin(o), (90.0 - math.degrees(o)) % 360.0


def from_sumo(x: float, y: float, angle: float, length: float) -> tuple[float, float, float]:
    """The middle of the front edge and SUMO's degrees to centre and radians in (-pi, pi]."""
    o, half = (90.0 - angle) * RADIANS, length / 2  # SUMO's angles lie in [0, 360)
    if o <= -math.pi:
        o += 2 * math.pi
    return x - half * math.cos(o), y - half * math.sin(o), o


def front(state: BodyState) -> tuple[float, float, float]:
    """A state in SUMO's form; raises SimulationError when it is not finite."""
    body, x, y, v, o = state
    if not math.isfinite(x + y + v + o):  # SUMO hangs on an infinite angle
        raise SimulationError(f"{body.id}: state is not finite: {x}, {y}, {v}, {o}")
    return to_sumo(x, y, o, body.kind.length)
