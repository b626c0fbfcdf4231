"""Straight legs of a walk: when a body gets so far across, and how far along meanwhile."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from cavsumo.model.bodies import Kind


class WalkLeg(NamedTuple):
    """A straight leg: its speed [m/s], heading [rad], length [m], and whether it ends at rest."""

    speed: float
    heading: float
    length: float
    stops: bool = False


def walk_time(legs: Sequence[WalkLeg], left: float, kind: Kind) -> tuple[float, float] | None:
    """Time until so much of the way across is behind, and the way along meanwhile [s, m].

    The body begins at rest, and brakes as hard as it gains speed; None if it never gets there.
    """
    time = shift = v = 0.0
    for leg in legs:
        towards = math.cos(leg.heading)
        if towards > 1e-3 and leg.length * towards >= left:
            way = left / towards
            return time + _spent(way, v, leg.speed, kind), shift + way * math.sin(leg.heading)
        if not math.isfinite(leg.length):
            return None
        left -= leg.length * towards
        shift += leg.length * math.sin(leg.heading)
        speed = (
            min(leg.speed, math.sqrt(leg.length * kind.throttle_max)) if leg.stops else leg.speed
        )
        time += _spent(leg.length, v, speed, kind) if speed > 0.0 else 0.0
        time += leg.stops * speed / (2.0 * kind.throttle_max)
        v = 0.0 if leg.stops else speed
    return None


def _spent(way: float, v: float, speed: float, kind: Kind) -> float:
    """Time to walk so far from one speed to another one [s]."""
    a = math.copysign(kind.throttle_max, speed - v)
    changing = (speed - v) * (speed + v) / (2.0 * a)
    if changing >= way:
        return (math.sqrt(max(0.0, v * v + 2.0 * a * way)) - v) / a
    return (speed - v) / a + (way - changing) / speed
