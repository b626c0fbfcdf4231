"""A timestep of the model of a best response, and the prices of its ends for the tester.

Outcomes have prices: the tester earns 0 for its aim and minus a price otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cavsumo.agents.planning.grid import (
    REACTION_TIME,
    ZETAS,
    Floats,
    Grid,
    Ints,
    States,
    braking,
    zeta_of,
)
from cavsumo.agents.planning.opponent import STANDING_MPS

STAND, WALK = 0, 1  # an action is how much it shortens the time to the entry [timesteps]
PATIENCE_S = 10.0  # a tester that waits is disturbed once in so long, on average
BEHIND_M = 5.5  # an ego whose front is so far beyond the body has passed it
# Of the human reference driver (UN R157), as egos.reference.human: until full braking, as if it
# came at once [s], and that [m/s2].
HUMAN_REACTION_S, HUMAN_DECEL = 1.45, 0.774 * 9.80665
NOTICE_BLUR_S = 0.3  # around that time a failure is preventable with some probability


class Prices(NamedTuple):
    """The prices of the outcomes for the tester; its aim costs nothing.

    Attributes:
        held: a test that the ego passed.
        missed: no test.
        unfair: a body in the braking zone first.
        unpreventable: a failure that a human driver would not have prevented either.
    """

    held: float = 1.0
    missed: float = 1.0
    unfair: float = 2.0
    unpreventable: float = 1.0


@dataclass(frozen=True)
class Aim:
    """The aim of the tester.

    Attributes:
        violation: a violation after a fair precondition; else the precondition.
        prices: of the other ends.
        confidence: of the sets around the counts; None to use the counts as they are.
        notice: for how long a body that walks can be seen on the road before it enters the strip
            [s]; None where every failure counts as preventable.
    """

    violation: bool = True
    prices: Prices = field(default_factory=Prices)
    confidence: float | None = None
    notice: float | None = None


class Moved(NamedTuple):
    """The result of a timestep: with probability ``over`` an end of that mean price."""

    states: States
    over: Floats
    price: Floats


def move(states: States, action: Ints, a: Floats, held: Ints, grid: Grid, aim: Aim) -> Moved:
    """One timestep in which the ego has the acceleration ``a`` and then the age ``held``."""
    dt = grid.dt
    v = np.maximum(0.0, states.v + a * dt)
    gap = states.gap - v * dt
    entry = states.entry - action
    after = States(entry, gap, v, np.minimum(held, grid.ages - 1))
    over, price = _ends_outside(after, grid, aim)
    inside = entry <= 1e-9
    if inside.any():
        entering = inside & (states.entry > 1e-9)
        over_in, price_in = _ends_inside(after, entering, grid, aim)
        over, price = np.where(inside, over_in, over), np.where(inside, price_in, price)
    return Moved(after, over, price)


def _ends_outside(after: States, grid: Grid, aim: Aim) -> tuple[Floats, Floats]:
    """Ends before the body is in the strip: the ego gets away, or cannot be avoided any more."""
    prices, dt = aim.prices, grid.dt
    late = zeta_of(after, dt) < ZETAS[0]
    committed = after.entry < grid.committed
    left = after.gap - after.v * after.entry * dt
    hit = late & committed & (left > -BEHIND_M)
    over = np.where(late, 1.0, dt / PATIENCE_S)
    return over, over * np.where(hit, prices.unfair, prices.missed)


def _ends_inside(
    after: States, entering: NDArray[np.bool_], grid: Grid, aim: Aim
) -> tuple[Floats, Floats]:
    """Ends in the strip; the zone that the body meets on entering is uncertain by a timestep."""
    prices, v, gap = aim.prices, after.v, after.gap
    blur = np.maximum(0.1, v * grid.dt / 2.0)
    early = np.clip((braking(v) + blur - gap) / (2.0 * blur), 0.0, 1.0) * entering
    early = np.where(v <= STANDING_MPS, 0.0, early)  # a standing ego has no zones
    spoilt = np.where(gap < -BEHIND_M, prices.missed, prices.unfair)
    if aim.violation:
        good = (gap <= 0.0) & (v > STANDING_MPS)
    else:
        good = (gap <= braking(v) + REACTION_TIME * v) & (v > STANDING_MPS)
    bad = ~good & ((v <= STANDING_MPS) | (after.entry < -grid.inside))
    over = early + (1.0 - early) * (good | bad)
    harmless = np.where(entering & (v <= STANDING_MPS), prices.missed, prices.held)
    late = prices.unpreventable * (1.0 - preventable(v, -after.entry * grid.dt, aim))
    return over, early * spoilt + (1.0 - early) * (bad * harmless + good * late)


def preventable(v: Floats, inside: Floats, aim: Aim) -> Floats:
    """The probability that a human driver could have stopped for a body that the ego hits.

    He sees it come since it was on the road, brakes after his reaction, and is there as late as an
    ego that drove at a constant speed.

    Args:
        v: speed of the ego at the impact [m/s].
        inside: for how long the body has been in the strip [s].
    """
    if not aim.violation or aim.notice is None:
        return np.ones_like(v)
    needed = HUMAN_REACTION_S + v / (2.0 * HUMAN_DECEL)
    spare = aim.notice + inside - needed
    return np.clip(0.5 + spare / NOTICE_BLUR_S, 0.0, 1.0)
