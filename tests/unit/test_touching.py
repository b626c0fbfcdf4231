"""Places of a grid that touch, against the labels of scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from cavsumo.assertions.metrics.touching import areas


@pytest.mark.parametrize("share", [0.05, 0.2, 0.4, 0.7])
def test_areas_are_those_of_scipy(share: float) -> None:
    """On grids of random places in any order: the same ones belong together."""
    rng = np.random.default_rng(7)
    for _ in range(100):
        grid = rng.random(rng.integers(3, 14, 2)) < share
        grid[0, 0] = True
        i, j = rng.permutation(np.argwhere(grid)).T
        found, labels = areas(i + 3, j - 2), ndimage.label(grid, np.ones((3, 3)))[0][i, j]
        assert len(set(zip(found, labels, strict=True))) == labels.max()
        assert sorted(set(found.tolist())) == list(range(labels.max()))
