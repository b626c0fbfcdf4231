"""The space that a pedestrian needs ahead of it to stop at once."""

from __future__ import annotations

import math
from collections.abc import Iterable

from cavsumo.model.bodies import Kind
from cavsumo.model.geometry import Box, overlap


def stopping_way(kind: Kind, v: float, dt: float) -> float:
    """Stopping distance of a body at full braking [m]; at least v^2 / (2 b) + v dt / 2.

    The position follows one timestep behind the throttle, so a whole timestep is added.
    """
    return v * dt + v * v / (-2.0 * kind.throttle_min) if v > 0.0 else 0.0


def stretched(box: Box, way: float) -> Box:
    """The area that a box covers while it moves straight on [m]."""
    x, y, o, length, width = box
    half = way / 2
    return Box(x + half * math.cos(o), y + half * math.sin(o), o, length + way, width)


def is_clear(box: Box, others: Iterable[Box]) -> bool:
    """Whether a box touches none of the others."""
    return not any(overlap(box, other) for other in others)
