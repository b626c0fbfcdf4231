"""Intervals of time as timesteps."""

from __future__ import annotations

import math

from cavsumo.assertions.formulas.nodes import Interval

STEP_TOLERANCE = 1e-9  # of a timestep


def steps_of(within: Interval, dt: float) -> tuple[int, int | None]:
    """The first and the last timestep within an interval, None for no last one.

    The first is after the last if the interval falls between two timesteps.
    """
    begin = math.ceil(within.begin / dt - STEP_TOLERANCE)
    if math.isinf(within.end):
        return begin, None
    return begin, math.floor(within.end / dt + STEP_TOLERANCE)
