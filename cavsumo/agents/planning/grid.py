"""The states of the model in which a best response is planned: a grid.

A state is (entry, zeta, v, held, class):

* ``entry``: timesteps until the body enters the strip that the ego sweeps if it walks now. Walking
  reduces it by exactly one, at any speed of the body; standing leaves it as it is (braking from
  full speed it first falls and then grows again by as much). Below 0 it is in the strip.
* ``zeta = (e - d_b) / s``: the gap e left when the body enters if the ego keeps its speed, less the
  braking zone d_b = v^2 / (2 b), in lengths s of the reaction zone. A fair test has 0 < zeta <= 1.
  An ego that keeps its speed keeps its zeta while the body walks, without interpolation error.
* ``v``: speed of the ego; zeta and v are interpolated, the others are exact.
* ``held``, ``class``: for how long the ego has had its acceleration, and which (``opponent``).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cavsumo.agents.planning.opponent import MIDDLES_MPS2, OLDEST, Counts

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MAX_DECEL, REACTION_TIME = 9.0, 0.675  # of the zones aimed at, as in the reaction-zone assertion
SLOWEST_MPS = 2.2  # below this speed the reaction zone is measured as at this speed
BEFORE_S, INSIDE_S = 1.4, 1.2  # extent of the grid before and after the entry
COMMITTED_S = 0.8  # from here on the body walks, since it could hardly stop any more
SPEEDS = np.array([0.0, 1.5, 3.5, 5.5, 8.0, 11.0, 14.0])  # m/s
ZETAS = np.linspace(-0.9, 2.7, 13)
CERTAIN = 0.9  # an acceleration whose hazard is above this gets no older in the model
CLASSES = len(MIDDLES_MPS2)


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


class States(NamedTuple):
    """Some states, one number each; entry in timesteps, gap is that of now [m]."""

    entry: Floats
    gap: Floats
    v: Floats
    held: Ints


def braking(v: Any) -> Any:
    """Length of the braking zone [m]."""
    return v * v / (2.0 * MAX_DECEL)


def scale(v: Any) -> Any:
    """Length of the reaction zone, at least that at SLOWEST_MPS [m]."""
    return REACTION_TIME * np.maximum(v, SLOWEST_MPS)


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
