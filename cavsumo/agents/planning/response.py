"""The best response to a counted ego: a Markov decision process on a grid, solved as a game.

Player 2 has one action (or, for a robust plan, may bend the counts within their confidence).
A state is (entry, zeta, v, held, class):

* ``entry``: timesteps until the body enters the strip that the ego sweeps if it walks now. Walking
  reduces it by exactly one, at any speed of the body; standing leaves it as it is (braking from
  full speed it first falls and then grows again by as much). Below 0 it is in the strip.
* ``zeta = (e - d_b) / s``: the gap e left when the body enters if the ego keeps its speed, less the
  braking zone d_b = v^2 / (2 b), in lengths s of the reaction zone. A fair test has 0 < zeta <= 1.
  An ego that keeps its speed keeps its zeta while the body walks, without interpolation error.
* ``v``: speed of the ego; zeta and v are interpolated, the others are exact.
* ``held``, ``class``: for how long the ego has had its acceleration, and which (``opponent``).

In each timestep the ego keeps its acceleration or chooses anew, by the counts. Outcomes have
prices: the tester earns 0 for its aim and minus a price otherwise.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cavsumo.agents.planning.opponent import (
    ENTRY_S,
    MIDDLES_MPS2,
    NEED_MPS2,
    OLDEST,
    SPEED_MPS,
    STANDING_MPS,
    Counts,
    Key,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MAX_DECEL, REACTION_TIME = 9.0, 0.675  # of the zones aimed at, as in the reaction-zone assertion
SLOWEST_MPS = 2.2  # below this speed the reaction zone is measured as at this speed
BEFORE_S, INSIDE_S = 1.4, 1.2  # extent of the grid before and after the entry
COMMITTED_S = 0.8  # from here on the body walks, since it could hardly stop any more
SPEEDS = np.array([0.0, 1.5, 3.5, 5.5, 8.0, 11.0, 14.0])  # m/s
ZETAS = np.linspace(-0.9, 2.7, 13)
CERTAIN = 0.9  # an acceleration whose hazard is above this gets no older in the model
CERTAIN_NOT = 0.01  # a hazard below this is none
NEGLIGIBLE = 1e-3  # branches less likely than this are left out
PATIENCE_S = 10.0  # a tester that waits is disturbed once in so long, on average
PRECISION = 1e-2
CLASSES = len(MIDDLES_MPS2)
STAND, WALK = 0, 1  # an action is how much it shortens the time to the entry [timesteps]
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


def braking(v: Any) -> Any:
    """Length of the braking zone [m]."""
    return v * v / (2.0 * MAX_DECEL)


def scale(v: Any) -> Any:
    """Length of the reaction zone, at least that at SLOWEST_MPS [m]."""
    return REACTION_TIME * np.maximum(v, SLOWEST_MPS)


class Grid(NamedTuple):
    """The states: all combinations of entry (last to first), zeta, v, held and class.

    Attributes:
        dt: timestep of the model [s].
        before, inside: timesteps before and after the entry.
        ages: number of ages; the last stands for all that are older.
    """

    dt: float
    before: int
    inside: int
    ages: int

    @property
    def shape(self) -> tuple[int, int, int, int, int]:
        """Lengths of the five axes."""
        return self.before + self.inside + 1, len(ZETAS), len(SPEEDS), self.ages, CLASSES

    @property
    def committed(self) -> int:
        """The last entry at which the body cannot stop before the strip any more."""
        return round(COMMITTED_S / self.dt)

    @property
    def layer(self) -> int:
        """Number of states with the same entry."""
        return int(np.prod(self.shape[1:]))

    @property
    def size(self) -> int:
        """Number of states."""
        return int(np.prod(self.shape))


def grid_for(counts: Counts, dt: float) -> Grid:
    """As many ages as the ego's decisions need."""
    ages = OLDEST + 1
    for held in range(OLDEST):
        if min(counts.hazard(0, held), counts.hazard(1, held)) >= CERTAIN:
            ages = held + 1
            break
    return Grid(dt, round(BEFORE_S / dt), round(INSIDE_S / dt), ages)


class Counted(NamedTuple):
    """The counts as arrays.

    Attributes:
        hazard: [aware, age] probability that the ego decides.
        chances: [entry cell, need cell, speed cell, class] least probability of each class then;
            the rest of 1 lies on the class that is worst for the tester.
        middles: [class] accelerations [m/s2].
    """

    hazard: Floats
    chances: Floats
    middles: Floats


def counted(counts: Counts, grid: Grid, confidence: float | None) -> Counted:
    """The counts as arrays for a grid, with sets around them if a confidence is given."""
    if confidence is None:
        chances = tabulated(counts.chances)
        chances[chances < NEGLIGIBLE] = 0.0
        chances /= chances.sum(axis=-1, keepdims=True)
    else:
        chances = tabulated(functools.partial(counts.floor, confidence=confidence))
    hazard = np.array([[counts.hazard(k, held) for held in range(grid.ages)] for k in (0, 1)])
    hazard[hazard < CERTAIN_NOT] = 0.0
    middles = [counts.middle(which) for which in range(CLASSES)]
    return Counted(hazard, chances, np.array(middles))


def tabulated(of: Callable[[Key], list[float]]) -> Floats:
    """A number for each class in every situation, shape (entry, need, speed, class)."""
    table = np.empty((len(ENTRY_S) + 1, len(NEED_MPS2) + 1, len(SPEED_MPS) + 1, CLASSES))
    for i, j, k in np.ndindex(*table.shape[:3]):
        table[i, j, k] = of((i, j, k))
    return table


class States(NamedTuple):
    """Some states, one number each; entry in timesteps, gap is that of now [m]."""

    entry: Floats
    gap: Floats
    v: Floats
    held: Ints


def situations(states: States, dt: float) -> tuple[Ints, Ints, Ints]:
    """The cells of ``opponent.situation``, for arrays."""
    gap = states.gap
    need = np.where(gap > 0.05, states.v**2 / (2.0 * np.maximum(gap, 0.05)), NEED_MPS2[-1] + 1.0)
    return (
        np.searchsorted(ENTRY_S, states.entry * dt, side="right"),
        np.searchsorted(NEED_MPS2, need, side="right"),
        np.searchsorted(SPEED_MPS, states.v, side="right"),
    )


def deciding(states: States, model: Counted, dt: float) -> tuple[Floats, Floats]:
    """Probability that the ego decides, shape (n,), and those of the classes then, (n, classes)."""
    cells = situations(states, dt)
    near = (cells[0] < len(ENTRY_S)).astype(int)
    held = np.minimum(states.held, model.hazard.shape[1] - 1)
    return model.hazard[near, held], model.chances[cells]


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


def zeta_of(states: States, dt: float) -> Floats:
    """Position in the zones at which the body enters, or is."""
    left = states.gap - states.v * np.maximum(states.entry, 0.0) * dt
    zeta: Floats = (left - braking(states.v)) / scale(states.v)
    return zeta


def corners(states: States, which: Ints, grid: Grid) -> tuple[Ints, Floats]:
    """The states of the grid around some states, with weights, both of shape (8, n)."""
    entry = np.clip(states.entry, -grid.inside, grid.before)
    entry = np.where((entry > 0.0) & (entry < 1.0), 1.0, entry)  # entering is an event between
    base = np.floor(entry + 1e-9)
    sides = [(base, 1.0 - (entry - base)), (np.minimum(base + 1, grid.before), entry - base)]
    z, dz = _between(zeta_of(states, grid.dt), ZETAS)
    s, ds = _between(states.v, SPEEDS)
    places, weights = [], []
    for n, w in sides:
        for i, wi in ((z, 1.0 - dz), (z + 1, dz)):
            for k, wk in ((s, 1.0 - ds), (s + 1, ds)):
                index = (n.astype(np.int64) + grid.inside, i, k, states.held, which)
                places.append(np.ravel_multi_index(index, grid.shape))
                weights.append(np.maximum(0.0, w) * wi * wk)
    return np.array(places), np.array(weights)


def _between(x: Floats, axis: Floats) -> tuple[Ints, Floats]:
    """The index on an axis below each x, clipped to its ends, and the fraction to the next."""
    i = np.clip(np.searchsorted(axis, x, side="right") - 1, 0, len(axis) - 2)
    return i, np.clip((x - axis[i]) / (axis[i + 1] - axis[i]), 0.0, 1.0)


class Backup(NamedTuple):
    """The values of some moves, by the decision of the ego.

    Attributes:
        decides: probability that it chooses anew, shape (n,).
        chances: [n, class] least probability of each; the rest of 1 lies on the worst class.
        keeps: worth if it keeps its acceleration, shape (n,).
        takes: [n, class] worth if it takes one.
    """

    decides: Floats
    chances: Floats
    keeps: Floats
    takes: Floats

    @property
    def worth(self) -> Floats:
        """The expected value, in the worst case that the counts permit."""
        rest = 1.0 - self.chances.sum(axis=1)
        takes = (self.chances * self.takes).sum(axis=1) + rest * self.takes.min(axis=1)
        worth: Floats = (1.0 - self.decides) * self.keeps + self.decides * takes
        return worth


@dataclass(frozen=True)
class Plan:
    """A best response, solved or being solved.

    Attributes:
        grid, aim, model: of the decision process.
        value: of each state, minus the expected price, flat.
    """

    grid: Grid
    aim: Aim
    model: Counted
    value: Floats = field(repr=False)

    def back_up(self, states: States, action: Ints, a: Floats, which: Ints) -> Backup:
        """One timestep from some states, then the values.

        Args:
            action: STAND or WALK for each.
            a: the ego's acceleration in the last timestep [m/s2]; ``which``: its class.
        """
        decides, chances = deciding(states, self.model, self.grid.dt)
        keeps = self._later(states, action, a, states.held + 1, which)
        anew, takes = np.zeros_like(states.held), np.zeros((len(action), CLASSES))
        if (decides > 0.0).any():
            for k, middle in enumerate(self.model.middles):
                taken = np.full(len(action), middle)
                takes[:, k] = self._later(states, action, taken, anew, np.full(len(action), k))
        return Backup(decides, chances, keeps, takes)

    def _later(self, states: States, action: Ints, a: Floats, held: Ints, which: Ints) -> Floats:
        moved = move(states, action, a, held, self.grid, self.aim)
        places, weights = corners(moved.states, which, self.grid)
        later = (self.value[places] * weights).sum(axis=0)
        worth: Floats = (1.0 - moved.over) * later - moved.price
        return worth
