"""A solved game as a table: the states from which its goal is sure, and all values.

Solutions are kept on disk, by the hash of the rules, so that a worker finds what its parent solved.
Stored solutions save time and do not change results.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from typing import Any

from cavsumo.agents.planning.rules import Rules
from cavsumo.model.cache import keep, kept

PRECISION = 1e-4
SNAP = 1e-6  # a number this close to a point of the lattice, in cells, is on it


@dataclass(frozen=True)
class Solved:
    """The solution of a game on the lattice of its rules.

    Attributes:
        rules: of the game.
        sure: for each walking state 1 where the goal can be forced, else 0; in C order over
            ``rules.shape``. More gap, less speed, less distance left and more pace never harm.
        value: for each of them a lower bound of its value.
    """

    rules: Rules
    sure: memoryview[int]
    value: memoryview[float]

    def surely(self, gap: float, v: float, left: float, walk: float) -> bool:
        """Whether the goal is sure at the corner of the cell that is worst for the tester.

        Units are those of the rules; an ego faster than those of the lattice is never sure.
        """
        i, j, k, m = self._cell(gap, v, left, walk)
        return self._sure(
            math.floor(i + SNAP), math.ceil(j - SNAP), math.ceil(k - SNAP), math.floor(m + SNAP)
        )

    def possibly(self, gap: float, v: float, left: float, walk: float) -> bool:
        """Whether it is sure at the best corner; if not, it can be forced from nowhere around."""
        i, j, k, m = self._cell(gap, v, left, walk)
        if k < SNAP:  # that corner is at the strip, where only the zones count, which never recede
            decel = self.rules.max_decel
            return gap > (0.5 * v * v / decel if decel else 0.0)
        j = min(j, float(self.rules.speeds - 1))
        return self._sure(
            math.ceil(i - SNAP),
            max(0, math.floor(j + SNAP)),
            math.floor(k + SNAP),
            math.ceil(m - SNAP),
        )

    def worth(self, gap: float, v: float, left: float, walk: float) -> float:
        """The value, interpolated between the corners of the cell; outside as at the edge."""
        total = 0.0
        cell, shape = self._cell(gap, v, left, walk), self.rules.shape
        corners = [(1.0, 0)]
        for x, size in zip(cell, shape, strict=True):
            x = min(max(x, 0.0), size - 1.0)
            low = min(int(x), max(0, size - 2))
            share = x - low
            corners = [
                (weight * part, number * size + low + step)
                for weight, number in corners
                for part, step in ((1.0 - share, 0), (share, 1))
                if part > 0.0
            ]
        for weight, number in corners:
            total += weight * self.value[number]
        return total

    def _cell(self, gap: float, v: float, left: float, walk: float) -> tuple[float, ...]:
        """The position of a state, in steps of the lattice."""
        rules = self.rules
        return (
            gap / rules.gap_step - 1.0,
            v / rules.speed_step - 1.0,
            left / rules.left_step - 1.0,
            walk / (rules.walk_accel * rules.interval),
        )

    def _sure(self, gap: int, speed: int, left: int, pace: int) -> bool:
        gaps, speeds, lefts, paces = self.rules.shape
        if gap < 0 or speed >= speeds or left >= lefts:
            return False
        i, j, k, m = min(gap, gaps - 1), max(0, speed), max(0, left), min(pace, paces - 1)
        return bool(self.sure[((i * speeds + j) * lefts + k) * paces + m])


@lru_cache(maxsize=16)
def solved(rules: Rules) -> Solved:
    """The solution of a game: from this process, from disk, or solved now."""
    size = math.prod(rules.shape)
    found = kept(_entry(rules))
    if found is None or len(found) != 9 * size:
        found = _solve(rules)
        keep(_entry(rules), found)
    values: memoryview[float] = memoryview(found[: 8 * size]).cast("d")
    return Solved(rules, memoryview(found[8 * size :]), values)


def _solve(rules: Rules) -> bytes:
    """Values of the walking states as doubles, then where they are sure as bytes."""
    from cavsumo.agents.planning.lattice import build
    from cavsumo.games import solve, sure_region

    size = math.prod(rules.shape)
    sure: Any = sure_region(build(rules, trapped=True)).inside[-size:]
    value: Any = solve(build(rules, trapped=False), precision=PRECISION).lower[-size:]
    found: bytes = value.astype("=f8").tobytes() + sure.astype("u1").tobytes()
    return found


def _entry(rules: Rules) -> str:
    """The name of a solution on disk; compiled sweeps have another, as the last digits differ."""
    compiled = "-numba" if find_spec("numba") else ""
    return f"game-{rules.key[:32]}{compiled}.bin"
