"""Places of a grid that touch, as areas.

``scipy.ndimage.label`` does the same, but would be a fifth of the start of each process that plays.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Places = NDArray[np.intp]
Run = tuple[int, int, int]  # consecutive places of a row: the row, the first and the last column


def areas(i: Places, j: Places) -> Places:
    """The area of each place, from 0 on, shape (n,); places that touch, at a corner too, share it.

    Args:
        i, j: rows and columns of the places, shape (n,), each place once.
    """
    order = np.lexsort((j, i))
    row, column = i[order], j[order]
    first = np.flatnonzero(np.r_[True, (np.diff(row) != 0) | (np.diff(column) > 1)])
    last = np.r_[first[1:], len(row)] - 1
    runs = zip(row[first].tolist(), column[first].tolist(), column[last].tolist(), strict=True)
    found = np.empty(len(row), dtype=np.intp)
    found[order] = np.repeat(_joined(list(runs)), last - first + 1)
    return np.unique(found, return_inverse=True)[1].reshape(-1)


def _joined(runs: list[Run]) -> list[int]:
    """A number for each run, the same for those that touch; the runs are sorted."""
    area, above = list(range(len(runs))), 0
    for k, (row, first, last) in enumerate(runs):
        while runs[above][0] < row - 1:
            above += 1
        for other, (its_row, its_first, its_last) in enumerate(runs[above:k], above):
            if its_row < row and its_first <= last + 1 and its_last >= first - 1:
                both = area[other], area[k]
                area = [min(both) if one in both else one for one in area]
    return area
