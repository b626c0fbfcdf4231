"""Distributions of one number, as an exposure states them, by their quantiles.

X = Q(u) with u uniform on [0, 1] has the distribution cut to [low, high]::

    Q(u) = F^-1( F(low) + u (F(high) - F(low)) )
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

Number = Annotated[float, Field(allow_inf_nan=False)]
LEAST_MASS = 1e-6  # less than this within the bounds is no support


class _Cut(BaseModel):
    """A distribution cut to bounds."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    low: Number = 0.0
    high: Number | None = None

    @model_validator(mode="after")
    def _has_support(self) -> _Cut:
        self.within(-math.inf, math.inf)
        return self

    def cdf(self, x: float) -> float:
        """The uncut distribution function."""
        raise NotImplementedError

    def inverse(self, share: float) -> float:
        """Its inverse."""
        raise NotImplementedError

    def within(self, low: float, high: float) -> tuple[float, float]:
        """The uncut distribution at its bounds and others; ValueError where nothing lies within."""
        least = max(low, self.low)
        most = min(high, math.inf if self.high is None else self.high)
        begin, end = self.cdf(least), self.cdf(most) if most > least else 0.0
        if not end - begin >= LEAST_MASS:
            raise ValueError(f"expected a distribution with mass between {least:g} and {most:g}")
        return begin, end

    def quantile(self, u: float, low: float = -math.inf, high: float = math.inf) -> float:
        """Q(u), cut further to [low, high]."""
        begin, end = self.within(low, high)
        found = self.inverse(begin + u * (end - begin))
        top = min(high, math.inf if self.high is None else self.high)
        return min(max(found, low, self.low), top)


class Normal(_Cut):
    """The normal distribution."""

    distribution: Literal["normal"]
    mean: Number
    sd: Annotated[Number, Field(gt=0.0)]

    def cdf(self, x: float) -> float:
        from scipy.special import ndtr

        return float(ndtr((x - self.mean) / self.sd))

    def inverse(self, share: float) -> float:
        from scipy.special import ndtri

        return self.mean + self.sd * float(ndtri(share))


class LogNormal(_Cut):
    """The logarithm is normal with the standard deviation ``sigma``."""

    distribution: Literal["lognormal"]
    median: Annotated[Number, Field(gt=0.0)]
    sigma: Annotated[Number, Field(gt=0.0)]

    def cdf(self, x: float) -> float:
        from scipy.special import ndtr

        return float(ndtr(math.log(x / self.median) / self.sigma)) if x > 0.0 else 0.0

    def inverse(self, share: float) -> float:
        from scipy.special import ndtri

        return self.median * float(np.exp(self.sigma * ndtri(share)))


class Exponential(_Cut):
    """The exponential distribution."""

    distribution: Literal["exponential"]
    mean: Annotated[Number, Field(gt=0.0)]

    def cdf(self, x: float) -> float:
        return -math.expm1(-x / self.mean) if x > 0.0 else 0.0

    def inverse(self, share: float) -> float:
        return -self.mean * math.log1p(-share) if share < 1.0 else math.inf


class Histogram(_Cut):
    """A histogram: ``shares`` between successive ``edges``, uniform within each."""

    distribution: Literal["histogram"]
    edges: Annotated[tuple[Number, ...], Field(min_length=2)]
    shares: tuple[Annotated[Number, Field(ge=0.0)], ...]

    @model_validator(mode="after")
    def _integrates(self) -> Histogram:
        if len(self.shares) != len(self.edges) - 1:
            raise ValueError(f"shares: expected {len(self.edges) - 1}, one between two edges")
        if any(b <= a for a, b in zip(self.edges, self.edges[1:], strict=False)):
            raise ValueError("edges: expected ascending numbers")
        if abs(math.fsum(self.shares) - 1.0) > 1e-9:
            raise ValueError(f"shares: expected a sum of 1, got {math.fsum(self.shares):g}")
        return self

    def cdf(self, x: float) -> float:
        sums = np.append(0.0, np.cumsum(self.shares))
        return float(np.interp(x, self.edges, sums))

    def inverse(self, share: float) -> float:
        sums = np.append(0.0, np.cumsum(self.shares))
        i = min(max(int(np.searchsorted(sums, share, "right")) - 1, 0), len(self.shares) - 1)
        part = (share - sums[i]) / self.shares[i] if self.shares[i] > 0.0 else 1.0
        return float(self.edges[i] + min(max(part, 0.0), 1.0) * (self.edges[i + 1] - self.edges[i]))


KINDS = {
    "normal": Normal,
    "lognormal": LogNormal,
    "exponential": Exponential,
    "histogram": Histogram,
}
Distribution = Annotated[
    Normal | LogNormal | Exponential | Histogram, Field(discriminator="distribution")
]
