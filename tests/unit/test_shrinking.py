"""The search for the smallest value: 1-minimal, each value asked once, in a fixed order."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cavsumo.kept.shrinking import smallest, subsets

Items = tuple[int, ...]


def test_parts_are_dropped_large_ones_first() -> None:
    """All, the halves, then single ones."""
    assert list(subsets("abcd")) == [
        (), tuple("cd"), tuple("ab"), tuple("bcd"), tuple("acd"), tuple("abd"), tuple("abc"),
    ]  # fmt: skip
    assert list(subsets("")) == []


@given(st.sets(st.integers(0, 15), max_size=4))
def test_what_is_needed_is_left(needed: set[int]) -> None:
    """Of sixteen items those that are needed, wherever they are; none is asked about twice."""
    asked: list[Items] = []

    def holds(items: Items) -> bool:
        asked.append(items)
        return needed <= {*items}

    found = smallest(tuple(range(16)), holds, [subsets], len)
    assert {*found} == needed
    assert len(asked) == len({*asked}) <= 16 * 4


def test_it_is_minimal_where_parts_depend_on_each_other() -> None:
    """An even number of items above three: no single one can go, although fewer would do."""
    found = smallest(tuple(range(9)), lambda items: len(items) % 2 == 1, [_single], len)
    assert len(found) == 9


def test_passes_are_tried_again_after_others() -> None:
    """What one kind of reduction makes possible for another is found."""

    def halved(pair: tuple[int, int]) -> Iterator[tuple[int, int]]:
        yield pair[0] // 2, pair[1]

    def less(pair: tuple[int, int]) -> Iterator[tuple[int, int]]:
        yield pair[0], pair[1] - 1

    def holds(pair: tuple[int, int]) -> bool:
        return pair[1] >= 0 and pair[0] >= pair[1]

    assert smallest((8, 2), holds, [halved, less], sum) == (0, 0)


def test_a_reduction_that_costs_more_is_none() -> None:
    """So the search ends."""
    assert smallest(3, lambda _: True, [lambda n: iter([n + 1])], lambda n: n) == 3


def _single(items: Items) -> Iterator[Items]:
    """The items without a single one."""
    yield from (items[:i] + items[i + 1 :] for i in range(len(items)))


@pytest.mark.parametrize("count", [1, 7, 50])
def test_what_is_irrelevant_goes_at_once(count: int) -> None:
    """One question is enough for all of it."""
    asked = []
    found = smallest(tuple(range(count)), lambda items: not asked.append(items), [subsets], len)
    assert (found, asked) == ((), [()])
