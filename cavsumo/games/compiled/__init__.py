"""Loops compiled by numba (extra ``fast``), each in place of a numpy path that does the same.

Solving a large game takes most time in a few loops over outcomes. numpy needs several passes and
large temporary arrays for each; compiled code needs one pass and no temporary arrays. Both paths
give the same answers up to rounding, with the same certificates. Compiled on first use and cached
by numba.
"""

from __future__ import annotations

from functools import cache

COMPILED = 200_000  # outcomes from which compiled loops are worth loading


def worth_it(outcomes: int) -> bool:
    """Whether to use compiled loops: the game is large enough and numba is installed."""
    return outcomes >= COMPILED and _installed()


@cache
def _installed() -> bool:
    """Whether numba can be imported."""
    try:
        import numba  # noqa: F401
    except ImportError:
        return False
    return True
