"""Stratified sampling over the parts of an exposure that are decided by a share.

Somebody looks or does not, waits at red or does not: such a part cuts one coordinate of the cube in
two, and the strata are all combinations. Half of the vectors are spread over them in proportion,
half equally, so a rare kind of behaviour is met more often and no kind less than half as often as
by chance. With the weight w_h of a stratum, n_h vectors in it and X_h failures::

    p = sum of k_h X_h,   v = sum of k_h^2 X_h,   k_h = w_h / n_h

The interval is that of a weighted sum of counts by the gamma distribution, which is conservative
(Fay and Feuer 1997, Stat. Med. 16, 791); with one stratum it is the exact one of a Poisson count.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import NamedTuple

import numpy as np

from cavsumo.probability.protocol import ALL_PLAYED, Goal, PlayedVector, looks
from cavsumo.probability.tree import Bools, Floats, Ints
from cavsumo.probability.weights import Estimate, quantiles

MOST_CUTS = 4  # 16 strata


class Cut(NamedTuple):
    """A coordinate below and above a share of which an encounter is of another kind."""

    coordinate: int
    share: float


def cuts_of(names: Sequence[str], shares: Mapping[str, float]) -> tuple[Cut, ...]:
    """The cuts of coordinates with names, for some of which behaviour changes at a share."""
    return tuple(Cut(i, shares[name]) for i, name in enumerate(names) if name in shares)


@dataclass
class Stratified:
    """Strata with fixed shares of the vectors; a gamma interval at each look."""

    dimension: int
    goal: Goal
    rng: np.random.Generator
    cuts: Sequence[Cut] = ()
    over: str = ""
    history: list[Estimate] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._looks = looks(self.goal.episodes, 1.0 - self.goal.level)
        self._low, self._high = bounds(self.dimension, self.cuts)
        self.weights: Floats = (self._high - self._low).prod(1)
        self.played: Ints = np.zeros(len(self.weights), dtype=int)
        self.failures: Ints = np.zeros(len(self.weights), dtype=int)
        self._asked: Ints = np.zeros(0, dtype=int)
        self._told: Ints = np.zeros(0, dtype=int)  # the stratum of each vector told so far
        self._error = 0.0  # spent at the last look

    def ask(self) -> Floats:
        wanted = allocated(self.weights, self._looks[0].episodes)
        self._asked = np.repeat(np.arange(len(wanted)), wanted - self.played)
        low, high = self._low[self._asked], self._high[self._asked]
        vectors: Floats = low + (high - low) * self.rng.random(low.shape)
        return vectors

    def tell(self, played: Sequence[PlayedVector]) -> None:
        failed = np.array([one.failed for one in played])
        self.played += np.bincount(self._asked, minlength=len(self.played))
        self.failures += np.bincount(self._asked[failed], minlength=len(self.played))
        self._told = np.append(self._told, self._asked)
        self._error = self._looks.pop(0).error
        self.history.append(self._counted(self.failures))
        self.over = self.goal.reached(self.history[-1])
        if not self.over and not self._looks:
            self.over = ALL_PLAYED

    def of(self, happened: Bools) -> Estimate:
        strata = self._told[happened[: len(self._told)]]
        return self._counted(np.bincount(strata, minlength=len(self.weights)))

    def _counted(self, counts: Ints) -> Estimate:
        """The estimate from counts in the strata, at the last look."""
        factors, played = self.weights / self.played, int(self.played.sum())
        return weighted_counts(counts, factors, self._error, self.goal.level, played)

    def gain(self) -> tuple[float, float, float]:
        if not self.failures.any():
            return math.nan, 0.0, math.inf
        shares = self.failures / self.played
        drawn = np.random.default_rng(0).binomial(self.played, shares, (400, len(shares)))
        drawn = drawn[drawn.any(1)]
        low, high = quantiles(self._gain(drawn / self.played))
        return float(self._gain(shares[None])[0]), low, high

    def _gain(self, shares: Floats) -> Floats:
        """The variance of as many vectors by chance over that of the strata, for each row."""
        p = shares @ self.weights
        spread = (shares * (1.0 - shares)) @ (self.weights**2 / self.played)
        found: Floats = p * (1.0 - p) / self.played.sum() / np.maximum(spread, 1e-300)
        return found


def bounds(dimension: int, cuts: Sequence[Cut]) -> tuple[Floats, Floats]:
    """The lower and upper corners of the strata, each of shape (strata, dimension).

    Of several cuts the first are used; shares of 0 and 1 cut nothing.
    """
    used = [cut for cut in cuts if 0.0 < cut.share < 1.0][:MOST_CUTS]
    low, high = np.zeros((2 ** len(used), dimension)), np.ones((2 ** len(used), dimension))
    for row, above in enumerate(product((False, True), repeat=len(used))):
        for cut, over in zip(used, above, strict=True):
            (low if over else high)[row, cut.coordinate] = cut.share
    return low, high


def allocated(weights: Floats, episodes: int) -> Ints:
    """How many of the vectors each stratum gets, at least one; the largest gets what is left."""
    shares = 0.5 * weights + 0.5 / len(weights)
    counts = np.maximum(1, np.floor(shares * episodes)).astype(int)
    counts[int(np.argmax(weights))] += episodes - int(counts.sum())
    found: Ints = counts
    return found


def weighted_counts(
    failures: Ints, factors: Floats, error: float, level: float, episodes: int
) -> Estimate:
    """The weighted sum of counts, with the gamma interval that spends so much error."""
    from scipy.special import chdtri

    p, spread = float(factors @ failures), float(factors**2 @ failures)
    lower = 0.0
    if p > 0.0:
        lower = spread / (2 * p) * float(chdtri(2 * p**2 / spread, 1.0 - error / 2))
    largest = float(factors.max())
    more, wider = p + largest, spread + largest**2
    upper = min(1.0, wider / (2 * more) * float(chdtri(2 * more**2 / wider, error / 2)))
    effective = p**2 / spread if spread > 0.0 else 0.0
    one = float(factors[failures > 0].max()) / p if p > 0.0 else 1.0
    return Estimate(p, lower, upper, level, episodes, int(failures.sum()), effective, one)
