"""Checks that an ego's effectors can execute a command, for egos of users."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from cavsumo.egos.base import Acceleration, Command, Drive
from cavsumo.errors import EgoError
from cavsumo.model.bodies import Kind


def checked(
    command: Any, before: type | None, kind: Kind, names: Sequence[str] | None = None
) -> Command:
    """The command, if the ego's effectors can execute it; otherwise EgoError with the reason.

    Args:
        command: the ego's answer.
        before: the type of its earlier commands in this episode; None for the first.
        kind: of the ego's body.
        names: of the command's numbers, in messages; those of its fields if not given.
    """
    if not isinstance(command, (Acceleration, Drive)):
        raise EgoError(f"answered {command!r}, expected Acceleration or Drive")
    if before not in (None, type(command)):
        raise EgoError(f"changed from {before.__name__} to {command!r}")
    limits = [(kind.throttle_min, kind.throttle_max), (-kind.steering_max, kind.steering_max)]
    for name, value, (low, high) in zip(names or command._fields, command, limits, strict=False):
        if not within(value, low, high):
            raise EgoError(f"{name} must lie in [{low:g}, {high:g}], got {value!r}")
    return command


def within(value: Any, low: float, high: float) -> bool:
    """Whether a value is a finite number between two bounds, up to rounding."""
    try:
        return math.isfinite(value) and low - 1e-9 <= value <= high + 1e-9
    except (TypeError, OverflowError):
        return False
