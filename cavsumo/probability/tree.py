"""Regression trees (Breiman et al. 1984), grown best split first, small and deterministic.

A split is chosen among all features and thresholds by what it takes from the sum of squares; of
several equally good ones by the order of features and thresholds. No random numbers.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Tree:
    """A grown tree; node 0 is the root.

    Attributes:
        feature: on which a node splits; -1 at leaves.
        threshold: values up to it go left.
        left, right: the nodes below.
    """

    feature: Ints
    threshold: Floats
    left: Ints
    right: Ints

    @property
    def leaves(self) -> Ints:
        """The leaves, ascending."""
        return np.flatnonzero(self.feature < 0)

    def leaf(self, x: Floats) -> Ints:
        """The leaf of each row of ``x``, shape (n, features)."""
        node = np.zeros(len(x), dtype=np.int64)
        active = np.arange(len(x)) if self.feature[0] >= 0 else np.arange(0)
        while len(active):
            here = node[active]
            below = x[active, self.feature[here]] <= self.threshold[here]
            node[active] = np.where(below, self.left[here], self.right[here])
            active = active[self.feature[node[active]] >= 0]
        return node


class _Split(NamedTuple):
    """The best split of a node: what it takes from the sum of squares, and where it is."""

    gain: float
    feature: int
    threshold: float


def grown(x: Floats, y: Floats, leaves: int, least: int) -> Tree:
    """A tree of at most so many leaves, each with at least so many rows.

    Args:
        x: features, shape (n, features).
        y: what is explained, shape (n,) or (n, outputs); classes as indicators.
    """
    y = y.reshape(len(x), -1)
    nodes: list[list[float]] = [[-1, 0.0, -1, -1]]  # feature, threshold, left, right
    queue = list(_queued(x, y, np.arange(len(x)), 0, least))
    while queue and len(nodes) // 2 + 1 < leaves:
        _, node, rows, split = heapq.heappop(queue)
        below = x[rows, split.feature] <= split.threshold
        nodes[node] = [split.feature, split.threshold, len(nodes), len(nodes) + 1]
        for part in (rows[below], rows[~below]):
            nodes.append([-1, 0.0, -1, -1])
            for entry in _queued(x, y, part, len(nodes) - 1, least):
                heapq.heappush(queue, entry)
    feature, threshold, left, right = np.array(nodes).T
    return Tree(*(feature.astype(int), threshold, left.astype(int), right.astype(int)))


def _queued(
    x: Floats, y: Floats, rows: Ints, node: int, least: int
) -> Iterator[tuple[float, int, Ints, _Split]]:
    """The entry of a node in the queue of splits, if it can be split."""
    split = _best(x[rows], y[rows], least)
    if split is not None:
        yield -split.gain, node, rows, split


def _best(x: Floats, y: Floats, least: int) -> _Split | None:
    """The best split of some rows, None where none helps."""
    n = len(x)
    if n < 2 * least:
        return None
    order = np.argsort(x, axis=0, kind="stable")
    values = np.take_along_axis(x, order, axis=0)
    below = np.cumsum(y[order], axis=0)  # rows, features, outputs
    counts = np.arange(1, n + 1)[:, None]
    total = below[-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        parts = (below**2).sum(2) / counts + ((total - below) ** 2).sum(2) / (n - counts)
    gain = parts[:-1] - (total**2).sum(1) / n
    possible = values[1:] > values[:-1]
    possible[: least - 1] = False
    possible[n - least :] = False
    gain = np.where(possible, gain, -np.inf)
    at, feature = divmod(int(np.argmax(gain)), x.shape[1])
    if not gain[at, feature] > 1e-9 * max(1.0, float((y**2).sum())):
        return None
    threshold = 0.5 * (values[at, feature] + values[at + 1, feature])
    return _Split(float(gain[at, feature]), feature, float(threshold))
