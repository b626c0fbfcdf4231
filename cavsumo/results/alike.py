"""Failures that are alike: the same bins of speed and place, in a search as in a report."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

SPEED_BIN_MPS, PLACE_BIN_M = 2.0, 10.0
FEATURES = "impact_speed_mps", "from_side", "meets_m"  # columns


def bin_of(value: float, width: float) -> float:
    """The lower bound of the bin that a value lies in."""
    return math.floor(value / width + 1e-9) * width


def kind_of(row: Mapping[str, Any]) -> tuple[float, str, float]:
    """Impact speed, side and place of the failure of a row, as text of its cells or as numbers."""
    speed, place = _number(row["impact_speed_mps"]), _number(row["meets_m"])
    return bin_of(speed, SPEED_BIN_MPS), str(row["from_side"]), bin_of(place, PLACE_BIN_M)


def _number(cell: Any) -> float:
    """The number of a cell; 0 for an empty one."""
    number = float(cell) if cell not in ("", None) else 0.0
    return 0.0 if math.isnan(number) else number
