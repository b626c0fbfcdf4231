"""Spaces of actions and observations, and actions as plain numbers.

"effectors": for each effector a number in [-1, 1], from its lower to its upper limit; values
outside are clamped. "targets": for each body one of ``agents.features.TARGETS``. An action of
another form, or not finite, is refused.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from cavsumo.agents.features import TARGETS
from cavsumo.errors import AgentError
from cavsumo.model.bodies import Body, model_of

Vector = NDArray[np.float32]
ActionSpace = spaces.Box | spaces.MultiDiscrete


def team_space(bodies: Sequence[Body], actions: str) -> ActionSpace:
    """The actions of a team: two numbers a body (throttle, steering), or one target a body."""
    if actions == "targets":
        return spaces.MultiDiscrete([len(TARGETS)] * len(bodies))
    return normalised(len(model_of({"team": bodies}).effectors([b.id for b in bodies])))


def normalised(size: int) -> spaces.Box:
    """The box [-1, 1] of so many effectors."""
    return spaces.Box(-1.0, 1.0, (size,), dtype=np.float32)


def observation_space(entries: Sequence[tuple[str, float, float]]) -> spaces.Box:
    """The box of entries with name, lower and upper bound."""
    low, high = (np.array([e[i] for e in entries], dtype=np.float32) for i in (1, 2))
    return spaces.Box(low, high, dtype=np.float32)


def numbers(values: Any, space: ActionSpace, who: str) -> list[float]:
    """An action as plain floats within its space; raises AgentError for an invalid one."""
    size = space.shape[0]
    try:
        found = np.asarray(values, dtype=np.float64).reshape(-1).tolist()
    except (TypeError, ValueError):
        found = []
    if len(found) != size or not all(map(math.isfinite, found)):
        raise AgentError(f"{who}: an action is {size} finite numbers, got {values!r}")
    if isinstance(space, spaces.Box):
        return [min(1.0, max(-1.0, value)) for value in found]
    if not all(value.is_integer() and 0 <= value < len(TARGETS) for value in found):
        raise AgentError(f"{who}: a target is a number from 0 to {len(TARGETS) - 1}, got {values}")
    return found
