"""A yes or no for points of the plane, such as whether they lie on a carriageway.

A computation with the shapes of a network costs as much as all others of a timestep, and testers
walk where testers walked before. So the plane is divided into square cells, and at the middle of
each it is found out once in how wide a circle the answer is the same. A cell that is not within the
circle lies along a boundary: there every point is asked for. The answers are those of the
computation, to the last bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

SIDE_M = 0.5
REACH_M = 0.5 * SIDE_M * math.sqrt(2.0)  # from the middle of a cell to its corners
ROUNDING_M = 1e-6
MOST = 200_000  # cells that are remembered


class CellAnswer(NamedTuple):
    """An answer, and a distance from the point within which it cannot change [m]."""

    holds: bool
    room: float


class Cells:
    """The answers of a computation.

    Args:
        holds: the answer at a point (x, y) [m].
        found: the answer at a point, and its room.
    """

    def __init__(
        self, holds: Callable[[float, float], bool], found: Callable[[float, float], CellAnswer]
    ) -> None:
        self._holds, self._found = holds, found
        # Of each cell its middle and what holds there; None along a boundary.
        self._known: dict[tuple[float, float], tuple[float, float, CellAnswer] | None] = {}

    def at(self, x: float, y: float) -> CellAnswer:
        """The answer at a point."""
        cell = x // SIDE_M, y // SIDE_M
        known = self._known[cell] if cell in self._known else self._learn(cell)
        if known is None:
            return CellAnswer(self._holds(x, y), 0.0)
        there_x, there_y, found = known
        return CellAnswer(found.holds, found.room - math.hypot(x - there_x, y - there_y))

    def _learn(self, cell: tuple[float, float]) -> tuple[float, float, CellAnswer] | None:
        """Find out, and note, the answer in all of a cell; None along a boundary."""
        if len(self._known) >= MOST:
            self._known.clear()
        x, y = (SIDE_M * (number + 0.5) for number in cell)
        holds, room = self._found(x, y)
        known = (
            (x, y, CellAnswer(holds, room - ROUNDING_M)) if room > REACH_M + ROUNDING_M else None
        )
        self._known[cell] = known
        return known
