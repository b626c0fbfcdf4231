"""Failures that are alike: the same bins of speed and place, in a search as in a report."""

from __future__ import annotations

import math
from collections.abc import Mapping

SPEED_BIN_MPS, PLACE_BIN_M = 2.0, 10.0
FEATURES = "impact_speed_mps", "from_side", "meets_m"  # columns


def bin_of(value: float, width: float) -> float:
    """The lower bound of the bin that a value lies in."""
    return math.floor(value / width + 1e-9) * width


def kind_of(row: Mapping[str, str]) -> tuple[object, ...]:
    """Impact speed, side and place of the failure of a row, as text of its cells."""
    speed, place = float(row["impact_speed_mps"] or 0.0), float(row["meets_m"] or 0.0)
    return bin_of(speed, SPEED_BIN_MPS), row["from_side"], bin_of(place, PLACE_BIN_M)
