"""The largest value in a sliding window over a sequence."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]


def largest_ahead(x: Values, begin: int, end: int | None) -> Values:
    """The largest of x[i + begin] ... x[i + end] for each i; -inf where there are none.

    Positions after the last are left out; ``end`` None stands for all that follow. Takes
    O(n log(end - begin)): windows of twice the length are put together from two of the length.
    """
    n = len(x)
    if begin >= n:
        return np.full(n, -math.inf)
    if end is None or end >= n - 1:
        ahead = np.maximum.accumulate(x[::-1])[::-1]
        return np.concatenate([ahead[begin:], np.full(begin, -math.inf)])
    width = end - begin + 1
    best = np.concatenate([x[begin:], np.full(end, -math.inf)])
    span = 1
    while 2 * span <= width:
        best = np.maximum(best[:-span], best[span:])
        span *= 2
    return np.asarray(np.maximum(best[:n], best[width - span : width - span + n]))
