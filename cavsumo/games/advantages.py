"""The advantage of a cell: r(c) + sum over s' of T(c, s') V(s') - V(s).

Computed as r + sum of p (V(s') - V(s)): rounding errors are then in proportion to the differences
of values, not to the values, as bounds that are close together require.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cavsumo.games.model import Floats, Ints


def advantages(
    start: Ints,
    successor: Any,
    probability: Floats,
    reward: Floats,
    own: Ints,
    value: Floats,
    fast: bool,
) -> tuple[Floats, Floats]:
    """The advantage of every cell, and the sum of its terms without their signs.

    Args:
        start: where the outcomes of each cell begin.
        successor, probability: of each outcome.
        reward, own: of each cell: its reward and the state it belongs to.
        value: V of each state.
        fast: by compiled loops.
    """
    if fast:
        from cavsumo.games.compiled import systems

        found: tuple[Floats, Floats]
        found = systems.advantages(start, successor, probability, reward, own, value)
        return found
    terms = value[successor] - np.repeat(value[own], np.diff(start))
    terms *= probability
    advantage, size = (_sums(part, start) for part in (terms, np.abs(terms)))
    return advantage + reward, size + np.abs(reward)


def _sums(terms: Floats, start: Ints) -> Floats:
    """The sum of each part; a part may be empty."""
    some = np.diff(start) > 0
    found = np.zeros(len(start) - 1)
    found[some] = np.add.reduceat(terms, start[:-1][some]) if some.any() else 0.0
    return found
