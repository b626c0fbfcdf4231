"""A yes or no for points of the plane, such as whether they lie on a carriageway.

A computation with the shapes of a network costs as much as all others of a timestep, and testers
walk where testers walked before. Each computation also tells its room, a distance within which the
answer cannot change, so it answers for the points around it, in later episodes too. Of each square
cell of the plane the widest answer is remembered. The answers are those of the computation, to the
last bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

SIDE_M = 1.0
NARROW_M = 0.5  # in a cell whose widest answer reaches no farther, rooms are not computed any more
ROUNDING_M = 1e-6  # far above the rounding of any distance
MOST = 200_000  # cells that are remembered


class CellAnswer(NamedTuple):
    """An answer at a point, and a distance from there within which it cannot change [m]."""

    holds: bool
    room: float


class Cells:
    """The answers of a computation.

    Args:
        holds: the answer at a point (x, y) [m], for less than its room costs.
        room: a distance from a point within which the answer cannot change [m].
    """

    def __init__(
        self, holds: Callable[[float, float], bool], room: Callable[[float, float], float]
    ) -> None:
        self._holds, self._room = holds, room
        self._known: dict[tuple[float, float], tuple[float, float, CellAnswer]] = {}

    def at(self, x: float, y: float) -> CellAnswer:
        """The answer at a point; from the same cell, if one is known that reaches it."""
        cell = x // SIDE_M, y // SIDE_M
        known = self._known.get(cell)
        if known is not None:
            there_x, there_y, (holds, room) = known
            left = room - math.hypot(x - there_x, y - there_y) - ROUNDING_M
            if left > 0.0:
                return CellAnswer(holds, left)
            if room <= NARROW_M:
                return CellAnswer(self._holds(x, y), 0.0)
        answer = CellAnswer(self._holds(x, y), self._room(x, y))
        if known is None or answer.room > known[2].room:
            self._note(cell, (x, y, answer))
        return answer

    def _note(self, cell: tuple[float, float], known: tuple[float, float, CellAnswer]) -> None:
        """Remember an answer."""
        if len(self._known) >= MOST:
            self._known.clear()
        self._known[cell] = known
