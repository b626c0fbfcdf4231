"""A mixture of kernels on the unit cube, with a share by chance.

    q(u) = d + (1 - d) sum over centres c of  w_c  prod over i of  N(u_i; c_i, h_i) / Z_ci

Z_ci is what the normal density with the bandwidth h_i has within [0, 1], so q is exact. A density
is at least d, so no weight 1 / q is larger than 1 / d. The bandwidths are Scott's (1992,
Multivariate Density Estimation, section 6.3), widened.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cavsumo.probability.protocol import PlayedVector
from cavsumo.probability.tree import Floats

DEFENSIVE = 0.2
FEWEST, MOST = 40, 200  # centres: all failures, or the best
WIDENED = 2.0
NARROWEST = 1e-3
CHUNK = 2000  # vectors whose density is computed together


@dataclass(frozen=True, eq=False)
class Kernels:
    """A proposal; without centres it is the uniform density.

    Attributes:
        centres: shape (centres, dimension).
        weights: of the centres, summing to 1.
        width: bandwidth of each coordinate.
        defensive: the share by chance.
    """

    centres: Floats
    weights: Floats
    width: Floats
    defensive: float = DEFENSIVE

    @property
    def dimension(self) -> int:
        """The number of coordinates."""
        return int(self.centres.shape[1])

    def draw(self, count: int, rng: np.random.Generator) -> Floats:
        """Vectors of this density."""
        from scipy.special import ndtri

        uniform, chance = rng.random((count, self.dimension)), rng.random(count) < self.defensive
        if not len(self.centres):
            return uniform
        low, high = self._tails()
        own = rng.choice(len(self.weights), count, p=self.weights)
        inside = ndtri(low[own] + uniform * (high[own] - low[own]))
        near = np.clip(self.centres[own] + self.width * inside, 0.0, 1.0)
        drawn: Floats = np.where(chance[:, None], uniform, near)
        return drawn

    def density(self, vectors: Floats) -> Floats:
        """The density at some vectors."""
        if not len(self.centres):
            return np.ones(len(vectors))
        parts = [self._density(vectors[i : i + CHUNK]) for i in range(0, len(vectors), CHUNK)]
        return np.concatenate(parts)

    def _density(self, vectors: Floats) -> Floats:
        low, high = self._tails()
        scale = np.prod(np.sqrt(2.0 * np.pi) * self.width * (high - low), axis=1)
        apart = (vectors[:, None, :] - self.centres) / self.width
        near = np.exp(-0.5 * (apart**2).sum(2)) @ (self.weights / scale)
        density: Floats = self.defensive + (1.0 - self.defensive) * near
        return density

    def _tails(self) -> tuple[Floats, Floats]:
        """The normal distribution of each kernel at 0 and at 1."""
        from scipy.special import ndtr

        return ndtr(-self.centres / self.width), ndtr((1.0 - self.centres) / self.width)


def uniform(dimension: int) -> Kernels:
    """The uniform density."""
    return Kernels(np.zeros((0, dimension)), np.zeros(0), np.zeros(dimension))


def learned(vectors: Floats, weights: Floats, played: Sequence[PlayedVector]) -> Kernels:
    """Kernels at the failures; while there are few, at the best vectors by grade, too.

    Args:
        weights: of the vectors. Large ones are cut at their 90 % quantile, as one centre with most
            of the weight would be a mixture of one.
    """
    failed = np.array([one.failed for one in played])
    grades = np.where(failed, np.inf, [one.grade for one in played])
    count = min(max(FEWEST, int(failed.sum())), MOST)
    best = np.argsort(-grades, kind="stable")[:count]
    centres, known = vectors[best], weights[best]
    known = np.minimum(known, np.quantile(known, 0.9))
    known /= known.sum()
    spread = np.sqrt(known @ (centres - known @ centres) ** 2)
    width = WIDENED * spread * len(best) ** (-1.0 / (vectors.shape[1] + 4))
    return Kernels(centres, known, np.maximum(NARROWEST, width))
