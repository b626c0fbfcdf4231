"""The ratio of two failure probabilities on common random numbers.

Both egos met the same n encounters. With a and b failures, of which d were of one ego alone::

    log(ratio) = log(a / b),   variance  d / (a b)

(the delta method for paired shares). Encounters in which both fail cancel out, so the variance is
smaller than the 1/a - 1/n + 1/b - 1/n of two independent estimates.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from cavsumo.probability.weights import LEVEL

FEWEST = 5  # failures of each ego, for the normal approximation


@dataclass(frozen=True)
class Ratio:
    """A ratio of probabilities, with its interval.

    Attributes:
        value, lower, upper: the ratio and its interval.
        level: nominal coverage.
        episodes: pairs of episodes.
        first, second, both: failures of the first ego, of the second, of both in one encounter.
        saved: episodes of two independent estimates over those of the pairs, for as narrow an
            interval.
        refused: why it is not a result; empty for a result.
    """

    value: float
    lower: float
    upper: float
    level: float
    episodes: int
    first: int
    second: int
    both: int
    saved: float
    refused: str = ""


def ratio_of(first: Sequence[bool], second: Sequence[bool], level: float = LEVEL) -> Ratio:
    """The ratio of the shares of failures in paired episodes."""
    from scipy.special import ndtri

    n, a, b = len(first), sum(first), sum(second)
    both = sum(x and y for x, y in zip(first, second, strict=True))
    if min(a, b) < FEWEST:
        few = (
            f"{min(a, b)} failures of one ego are too few for a ratio, at least {FEWEST} are needed"
        )
        return Ratio(math.nan, 0.0, math.inf, level, n, a, b, both, math.nan, few)
    paired, apart = (a + b - 2 * both) / (a * b), 1 / a + 1 / b - 2 / n
    half = float(ndtri(0.5 + level / 2)) * math.sqrt(max(paired, 1.0 / (a * b)))
    value = a / b
    lower, upper = value * math.exp(-half), value * math.exp(half)
    saved = apart / paired if paired > 0.0 else math.inf
    return Ratio(value, lower, upper, level, n, a, b, both, saved)
