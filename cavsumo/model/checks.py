"""Checks of single values; each error is one sentence."""

from __future__ import annotations

import math
from typing import Any

from cavsumo.errors import InputError


def number(name: str, value: Any, low: float = -math.inf, high: float = math.inf) -> float:
    """A finite number within [low, high], or ValueError naming what was expected."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise ValueError(f"{name} must be a finite number, got {value!r}")
    if not low <= value <= high:
        raise ValueError(f"{name} must lie in [{low:g}, {high:g}], got {value!r}")
    return float(value)


def whole(name: str, value: Any, low: int = 0) -> int:
    """A whole number of at least ``low``, or ValueError naming what was expected."""
    if isinstance(value, bool) or not isinstance(value, int) or value < low:
        raise ValueError(f"{name} must be a whole number of at least {low}, got {value!r}")
    return value


def choice(name: str, value: Any, valid: tuple[str, ...]) -> str:
    """One of the valid words, or ValueError listing them."""
    if value not in valid:
        raise ValueError(f"{name} must be one of {', '.join(valid)}, got {value!r}")
    return str(value)


def truth(name: str, value: Any) -> bool:
    """A truth value, or ValueError saying how it is written."""
    if not isinstance(value, bool):
        raise ValueError(f"{name} must be true or false, got {value!r}")
    return value


def densities(value: Any) -> tuple[float, float]:
    """Cars and pedestrians per minute and kilometre: ``4`` for both, ``4,2``, or two numbers."""
    words = value.split(",") if isinstance(value, str) else value
    words = words if isinstance(words, list | tuple) else [words]
    try:
        found = [math.nan if isinstance(word, bool) else float(word) for word in words]
    except (TypeError, ValueError):
        found = []
    if len(found) not in (1, 2) or not all(0.0 <= number <= 100.0 for number in found):
        raise ValueError("must be a number from 0 to 100, or two for cars and pedestrians")
    return found[0], found[-1]


def assignment(option: str, word: str) -> tuple[str, bool | int | float | str]:
    """KEY=VALUE as a key and a truth value, a number or a word."""
    key, equals, value = word.partition("=")
    if not (key and equals):
        raise InputError(f"{option}: expected KEY=VALUE, got {word!r}")
    if value in ("true", "false"):
        return key, value == "true"
    for numeric in (int, float):
        try:
            return key, numeric(value)
        except ValueError:
            continue
    return key, value
