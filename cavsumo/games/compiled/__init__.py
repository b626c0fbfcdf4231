"""Loops compiled by numba (extra ``fast``), each in place of a numpy path that does the same.

Large games spend their time in a few loops over outcomes. numpy needs several passes and large
temporary arrays for each, compiled code one pass and none. Both paths give the same answers, up to
rounding, and what they give is certified alike. Compiled on first use and cached by numba.
"""

from __future__ import annotations

from functools import cache

COMPILED = 200_000  # outcomes from which compiled loops are worth loading


def worth_it(outcomes: int) -> bool:
    """Whether to use compiled loops: there is enough to do and numba is installed."""
    return outcomes >= COMPILED and _installed()


@cache
def _installed() -> bool:
    """Whether numba can be imported."""
    try:
        import numba  # noqa: F401
    except ImportError:
        return False
    return True
