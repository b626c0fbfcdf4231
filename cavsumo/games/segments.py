"""Arrays in parts: the beginning of each part, and the owner of each entry."""

from __future__ import annotations

from typing import Any

import numpy as np

from cavsumo.games.model import Floats, Ints


def spans(start: Ints, which: Ints, fast: bool = False) -> Ints:
    """The concatenated ranges start[w] : start[w + 1] for each w in ``which``."""
    if fast:
        from cavsumo.games.compiled import graphs

        compiled: Ints = graphs.spans(start, which)
        return compiled
    begin, length = start[which], start[which + 1] - start[which]
    ends = np.cumsum(length)
    total = int(ends[-1]) if len(ends) else 0
    found: Ints = np.arange(total) + np.repeat(begin - ends + length, length)
    return found


def starts(sizes: Ints) -> Ints:
    """The beginnings of parts of these sizes, and the end of the last."""
    return np.concatenate(([0], np.cumsum(sizes)))


def firsts(places: Ints, owner: Ints) -> Ints:
    """The first index of each owner; the entries of an owner are adjacent."""
    owners = owner[places]
    first = np.ones(len(places), dtype=bool)
    first[1:] = owners[1:] != owners[:-1]
    return places[first]


def gathered(
    start: Ints, successor: Any, probability: Floats, cells: Ints, number: Any, fast: bool
) -> tuple[Ints, Any, Floats]:
    """The outcomes of some cells: where each cell's begin, successors renumbered, probabilities."""
    if fast:
        from cavsumo.games.compiled import graphs

        compiled: tuple[Ints, Any, Floats]
        compiled = graphs.gathered(start, successor, probability, cells, number)
        return compiled
    outcome = spans(start, cells)
    begin = starts(start[cells + 1] - start[cells])
    return begin, number[successor[outcome]], probability[outcome]
