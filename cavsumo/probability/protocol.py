"""The protocol of estimators: they ask for random vectors and are told what came of them.

A vector is uniform on the unit cube by chance (an exposure makes an encounter of it), so the
likelihood ratio of a vector drawn with density q is 1 / q.

An estimator may end early. It looks at its results only after numbers of episodes that are fixed
before (``looks``), each with a part of the allowed error, so that the interval it ends with covers
the truth however the decision to end fell.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from cavsumo.probability.tree import Bools, Floats
from cavsumo.probability.weights import Estimate

ALL_PLAYED = "all episodes are played"
FEWEST_EPISODES = 100  # with fewer nothing is learned from pilots
FIRST_LOOK = 50  # episodes before which nothing is decided


class PlayedVector(NamedTuple):
    """The result of a vector: whether it failed, and how near it came (any increasing scale)."""

    failed: bool
    grade: float = 0.0


class Goal(NamedTuple):
    """The precision that is asked for.

    Attributes:
        episodes: the most that may be played.
        half_width: half of the interval over the estimate at which to end.
        bound: an upper end of the interval at which to end; None for none.
        level: nominal coverage of the intervals.
    """

    episodes: int
    half_width: float = 0.3
    bound: float | None = None
    level: float = 0.95

    def reached(self, found: Estimate) -> str:
        """The reason to end, empty for none."""
        if found.refused:
            return ""
        if self.bound is not None and found.upper <= self.bound:
            return f"the upper bound is at most {self.bound:g}"
        if found.relative <= self.half_width:
            return f"half of the interval is at most {self.half_width:g} of the estimate"
        return ""


class Look(NamedTuple):
    """A number of episodes after which an estimator may end, and the error spent there."""

    episodes: int
    error: float


class Estimator(Protocol):
    """Estimates a failure probability from vectors that it chooses.

    Attributes:
        over: why no more vectors are wanted; empty while some are.
        history: the estimate at each look so far.
    """

    over: str
    history: list[Estimate]

    def ask(self) -> Floats:
        """The vectors to play next, shape (n, dimension); n > 0 unless it is over."""

    def tell(self, played: Sequence[PlayedVector]) -> None:
        """Take up the results of the vectors that were asked for last, in their order."""

    def of(self, happened: Bools) -> Estimate:
        """The estimate at the last look of another event, by the same vectors.

        ``happened``: with each of the vectors told so far, in their order; more are left out.
        """

    def gain(self) -> tuple[float, float, float]:
        """The gain over Monte Carlo an episode, pilots included, with a 95 % interval."""


def looks(episodes: int, error: float) -> list[Look]:
    """The looks at so many episodes: the last at all, each before at half of the next.

    The error is spent in proportion to the episodes, most of it at the last look, and its parts sum
    to ``error`` (Lan and DeMets 1983, Biometrika 70, 659).
    """
    sizes = [episodes]
    while sizes[-1] // 2 >= FIRST_LOOK:
        sizes.append(sizes[-1] // 2)
    return [Look(size, error * size / sum(sizes)) for size in reversed(sizes)]
