"""The smallest value that still has a property, among those that single reductions lead to.

Greedy, as in delta debugging (Zeller and Hildebrandt, IEEE TSE 28(2), 2002): a reduction that keeps
the property is taken, until none of a value's reductions does. Then the value is *1-minimal*.
Every reduction lowers a cost, so the search ends; values that were tried are not tried again.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence
from typing import Any, TypeVar

Value = TypeVar("Value", bound=Hashable)
Item = TypeVar("Item")


def smallest(
    first: Value,
    holds: Callable[[Value], bool],
    passes: Sequence[Callable[[Value], Iterator[Value]]],
    cost: Callable[[Value], Any],
) -> Value:
    """The 1-minimal value to which reductions of ``first`` lead.

    Args:
        first: a value that has the property.
        holds: whether a value has it; asked once about each.
        passes: kinds of reduction in the order in which they are tried. Each gives the reductions
            of a value, large ones first; one that does not lower the cost is left out.
        cost: of a value; what it gives can be compared.
    """
    tried, best, again = {first}, first, True
    while again:
        again = False
        for reductions in passes:
            while (found := _next(best, reductions, holds, cost, tried)) is not None:
                best, again = found, True
    return best


def _next(
    best: Value,
    reductions: Callable[[Value], Iterator[Value]],
    holds: Callable[[Value], bool],
    cost: Callable[[Value], Any],
    tried: set[Value],
) -> Value | None:
    """The first reduction that keeps the property; None if none does."""
    for value in reductions(best):
        if value not in tried and cost(value) < cost(best):
            tried.add(value)
            if holds(value):
                return value
    return None


def subsets(items: Sequence[Item]) -> Iterator[tuple[Item, ...]]:
    """The sequence without a part: without all of it, without halves, quarters, ..., single ones.

    The parts are those of delta debugging, so many that belong together are dropped at once.
    """
    size = len(items)
    while size:
        for begin in range(0, len(items), size):
            yield (*items[:begin], *items[begin + size :])
        size //= 2
