"""Arithmetic in the files of suites: numbers computed from the parameters of a case."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from cavsumo.model import expressions
from cavsumo.model.expressions import Value as Value
from cavsumo.suites import careful_driver, crosswalk_cases, street_walks


def _one_if(truth: Callable[..., bool]) -> Callable[..., float]:
    """A function whose answer is 1 or 0."""
    return lambda *numbers: float(truth(*numbers))


FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "abs": abs,
    "acos": math.acos,
    "atan": math.atan,
    "cav_gym_points": street_walks.cav_gym_points,  # lists of places, not numbers
    "chance_points": street_walks.chance_points,
    "cos": math.cos,
    "crosswalk_errors": crosswalk_cases.errors,
    "crosswalk_points": crosswalk_cases.points,
    "cut_in_preventable": _one_if(careful_driver.cut_in_preventable),
    "cut_out_preventable": _one_if(careful_driver.cut_out_preventable),
    "deceleration_preventable": _one_if(careful_driver.deceleration_preventable),
    "deg": math.radians,  # degrees, as radians
    "kmh": lambda speed: speed / 3.6,  # km/h, as m/s
    "max": max,
    "min": min,
    "sin": math.sin,
    "sqrt": math.sqrt,
    "tan": math.tan,
}


def evaluated(text: str, names: Mapping[str, Value]) -> Value:
    """The value of an expression of a suite, see ``model.expressions``."""
    return expressions.evaluated(text, names, FUNCTIONS)
