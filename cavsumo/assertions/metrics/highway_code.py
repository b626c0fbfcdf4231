"""Stopping distances of the Highway Code (rules 126 and 227).

The table of rule 126 rounds a model in feet: thinking = v[mph] ft, braking = v[mph]^2 / 20 ft, that
is, a reaction time of 15/22 s and a deceleration of 6.557 m/s2.
"""

from __future__ import annotations

import math

from cavsumo.errors import InputError

MPH = 0.44704  # m/s
FOOT = 0.3048  # m
THINKING_S = FOOT / MPH  # 15/22 s
DECEL = 20.0 * MPH**2 / (2.0 * FOOT)  # m/s2
WET = 2.0  # rule 227: at least double on wet roads
# Rule 126: speed [mph] to thinking and braking distance [m].
TABLE = {20: (6, 6), 30: (9, 14), 40: (12, 24), 50: (15, 38), 60: (18, 55), 70: (21, 75)}


def uk_stopping_distance(
    speed_mph: float | None = None, speed_mps: float | None = None, *, wet: bool = False
) -> dict[str, float]:
    """Thinking and braking distance [m] by the model, and rounded to metres as in the table.

    Args:
        speed_mph, speed_mps: one of them, or both if they agree.
        wet: twice the distances.

    Returns ``thinking_m, braking_m, total_m`` as the table has them (for other speeds the model's,
    rounded) and ``thinking_model_m, braking_model_m``. Raises InputError for no speed.
    """
    mph = _mph(speed_mph, speed_mps)
    factor = WET if wet else 1.0
    thinking, braking = mph * FOOT * factor, mph**2 / 20.0 * FOOT * factor
    return {
        "thinking_m": round(thinking),
        "braking_m": round(braking),
        "total_m": round(thinking) + round(braking),
        "thinking_model_m": thinking,
        "braking_model_m": braking,
    }


def _mph(mph: float | None, mps: float | None) -> float:
    """The speed in miles per hour."""
    speeds = [v for v in (mph, None if mps is None else mps / MPH) if v is not None]
    if not speeds or not all(math.isfinite(v) and v >= 0.0 for v in speeds):
        raise InputError(f"uk_stopping_distance: no speed: {mph!r} mph, {mps!r} m/s")
    if not math.isclose(speeds[0], speeds[-1], rel_tol=1e-6):
        raise InputError(f"uk_stopping_distance: {mph} mph is not {mps} m/s")
    return speeds[0]
