"""A wrapper for learners that choose from a list of actions, such as tabular ones."""

from __future__ import annotations

import itertools
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from cavsumo.errors import InputError
from cavsumo.model.checks import whole


class DiscreteActions(gymnasium.ActionWrapper[Any, np.int64, Any]):
    """Choices from 0 on instead of a box or several lists.

    A box becomes a grid: each dimension takes ``levels`` values, evenly from its lower to its
    upper bound. Several lists, as of ``actions="targets"``, become one of all combinations.

    Args:
        env: with a Box or a MultiDiscrete action space.
        levels: values of each dimension of a box, odd so that 0 is one of them.

    Attributes:
        table: the action of each choice, a row each.

    Raises InputError when the choices are too many or the action space is another.
    """

    MOST: ClassVar[int] = 10_000

    def __init__(self, env: gymnasium.Env[Any, Any], levels: int = 3) -> None:
        super().__init__(env)
        space = env.action_space
        try:
            whole("levels", levels, 2)
        except ValueError as error:
            raise InputError(f"DiscreteActions: {error}") from error
        if isinstance(space, spaces.Box):
            bounds = zip(space.low.ravel(), space.high.ravel(), strict=True)
            values = [np.linspace(low, high, levels).tolist() for low, high in bounds]
        elif isinstance(space, spaces.MultiDiscrete):
            values = [range(n) for n in space.nvec]
        else:
            raise InputError(f"DiscreteActions: a Box or MultiDiscrete is needed, got {space}")
        count = np.prod([len(v) for v in values], dtype=object)
        if count > self.MOST:
            raise InputError(
                f"DiscreteActions: {count} choices, at most {self.MOST}; choose fewer levels"
            )
        self.table: NDArray[Any] = np.array(list(itertools.product(*values)), dtype=space.dtype)
        self.action_space = spaces.Discrete(len(self.table))

    def action(self, action: np.int64) -> NDArray[Any]:
        """The row of the table."""
        row: NDArray[Any] = self.table[int(action)].copy()
        return row
