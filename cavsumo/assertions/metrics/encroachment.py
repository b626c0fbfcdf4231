"""Post-encroachment time: from one body's leaving an area that both sweep to the other's entering
it.

A body is in that area while its box touches what the other's box sweeps. Tracks are taken for
piecewise straight: between two moments a box moves straight on, so that the times of straight
motion are exact for any timestep. Where a box turns, the pieces are so short that its corners stay
within ``SLACK_M`` of their place.

Two bodies may sweep several common areas, or an endless one if one follows the other. So an area
consists of consecutive pieces that touch, where the courses cross by at least ``CROSSING_RAD``.
Nearly parallel courses have no area that one body leaves before the other enters; there it is the
shortest time between the one's being at a place and the other's coming.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cavsumo.assertions.metrics.plane import ttc_boxes

Numbers = NDArray[np.float64]
Places = NDArray[np.intp]
CROSSING_RAD = math.radians(10.0)  # courses that meet at less are nearly parallel
SLACK_M = 0.05
ROUNDING_M = 1e-6  # added to a bound that must not exclude bodies that just touch
# Beginning and end of a piece, of the one body against both of the other.
ENDS = np.array([[0.0], [0.0], [1.0], [1.0]]), np.array([[0.0], [1.0], [0.0], [1.0]])


def pet(first_leaves_t: ArrayLike, second_enters_t: ArrayLike) -> Numbers:
    """Post-encroachment time, negative for an overlap (Allen, Shin and Cooper 1978) [s]."""
    return np.subtract(second_enters_t, first_leaves_t, dtype=np.float64)


def pet_tracks(times: ArrayLike, first: ArrayLike, second: ArrayLike) -> float:
    """Post-encroachment time of two tracks of boxes [s]; infinite if they share no place.

    The time between the one's leaving and the other's entering an area that both sweep, of several
    areas the shortest. 0 if both are in it at once, bodies that touch among them.

    Args:
        times: shape (n,), increasing [s].
        first, second: shape (n, 5): x, y [m], heading [rad], length, width [m].
    """
    a, b = moves(times, first), moves(times, second)
    pairs = np.indices((len(a.begin), len(b.begin))).reshape(2, -1)
    return pet_moves(a, b, *near(a, b, *pairs))


class Moves(NamedTuple):
    """A track in pieces on which its box moves straight on and does not turn.

    Attributes:
        moment: the index of the moment that each begins with or lies behind, shape (n,).
        begin, lasts: when each begins and how long it takes, shape (n,) [s].
        x, y, way_x, way_y: the centre at its beginning, and how far it comes, shape (n,) [m].
        heading: shape (n,) [rad].
        length, width: of the box, shape (n,) [m].
    """

    moment: Places
    begin: Numbers
    lasts: Numbers
    x: Numbers
    y: Numbers
    way_x: Numbers
    way_y: Numbers
    heading: Numbers
    length: Numbers
    width: Numbers

    def at(self, pieces: Places | NDArray[np.bool_]) -> Moves:
        """Some of the pieces, in that order."""
        return Moves(self.moment[pieces], *(column[pieces] for column in self[1:]))

    def times(self, enter: Numbers, leave: Numbers) -> Numbers:
        """When these shares of the pieces have passed, shape (2, n) [s]."""
        return self.begin + np.clip([enter, leave], 0.0, 1.0) * self.lasts

    def after(self, share: Numbers) -> tuple[Numbers, Numbers]:
        """The time when so much of each piece has passed, and the box then, shape (..., n, 5)."""
        x, y = self.x + share * self.way_x, self.y + share * self.way_y
        columns = np.broadcast_arrays(x, y, self.heading, self.length, self.width)
        return self.begin + share * self.lasts, np.stack(columns, axis=-1)

    def circles(self) -> tuple[Numbers, Numbers, Numbers]:
        """Centres and radii of circles that hold what each piece sweeps, shape (n,) each [m]."""
        reach = np.hypot(self.length, self.width) + np.hypot(self.way_x, self.way_y)
        return self.x + self.way_x / 2.0, self.y + self.way_y / 2.0, reach / 2.0


def moves(times: ArrayLike, boxes: ArrayLike) -> Moves:
    """A track in pieces; of one moment alone a piece that takes no time.

    Args:
        times: shape (n,), increasing [s].
        boxes: shape (n, 5): x, y [m], heading [rad], length, width [m].
    """
    t, b = np.asarray(times, float), np.asarray(boxes, float)
    if len(t) == 1:
        t, b = np.repeat(t, 2), np.repeat(b, 2, axis=0)
    now, lasts, step = b[:-1], np.diff(t), np.diff(b[:, :3], axis=0)
    turn = np.remainder(step[:, 2] + math.pi, math.tau) - math.pi
    # The heading of a piece is that of its middle: half its turn off at the ends.
    corner = np.hypot(now[:, 3], now[:, 4]) / 2.0
    pieces = np.maximum(1, np.ceil(np.abs(turn) * corner / (2.0 * SLACK_M))).astype(int)
    of = np.repeat(np.arange(len(pieces)), pieces)
    share = 1.0 / pieces[of]
    before = (np.arange(len(of)) - (np.cumsum(pieces) - pieces)[of]) * share
    return Moves(
        of,
        t[:-1][of] + before * lasts[of],
        share * lasts[of],
        now[of, 0] + before * step[of, 0],
        now[of, 1] + before * step[of, 1],
        share * step[of, 0],
        share * step[of, 1],
        now[of, 2] + (before + share / 2.0) * turn[of],
        now[of, 3],
        now[of, 4],
    )


class Spells(NamedTuple):
    """The times at which each of two bodies is in an area that both sweep [s]."""

    enters: float
    leaves: float
    other_enters: float
    other_leaves: float


def spells(first: Moves, second: Moves, least: float = CROSSING_RAD) -> Spells | None:
    """The times of two bodies in the area that both their pieces sweep; None without such an area.

    Args:
        least: the angle by which the ways must cross [rad].
    """
    pairs = np.indices((len(first.begin), len(second.begin))).reshape(2, -1)
    i, j = near(first, second, *pairs)
    a, b = first.at(i), second.at(j)
    enter, leave = presence(a, b)
    met = (enter <= leave) & (np.abs(np.sin(a.heading - b.heading)) >= math.sin(least) - 1e-9)
    if not met.any():
        return None
    a, b = a.at(met), b.at(met)
    mine, theirs = a.times(enter[met], leave[met]), b.times(*presence(b, a))
    return Spells(
        *(float(t) for t in (mine[0].min(), mine[1].max(), theirs[0].min(), theirs[1].max()))
    )


def near(first: Moves, second: Moves, i: Places, j: Places) -> tuple[Places, Places]:
    """The pairs of pieces whose boxes may touch, by the circles that hold what each sweeps.

    They have to meet, and the second to reach into the strip that the first sweeps.
    """
    (x, y, reach), (u, w, other) = first.circles(), second.circles()
    cos, sin = np.cos(first.heading), np.sin(first.heading)
    strip = (first.width + np.abs(first.way_y * cos - first.way_x * sin)) / 2.0
    dx, dy, theirs = u[j] - x[i], w[j] - y[i], other[j] + ROUNDING_M
    meet = np.hypot(dx, dy) <= reach[i] + theirs
    meet &= np.abs(dy * cos[i] - dx * sin[i]) <= strip[i] + theirs
    return i[meet], j[meet]


def pet_moves(first: Moves, second: Moves, i: Places, j: Places) -> float:
    """Post-encroachment time of two tracks in pieces [s].

    Args:
        i, j: which pieces of the first and of the second are compared, pair by pair, shape (n,).
    """
    if not len(i):
        return math.inf
    a, b = first.at(i), second.at(j)
    enter, leave = presence(a, b)
    met = enter <= leave
    if not met.any():
        return math.inf
    i, j, a, b = i[met], j[met], a.at(met), b.at(met)
    times = a.times(enter[met], leave[met]), b.times(*presence(b, a))
    cross = np.abs(np.sin(a.heading - b.heading)) >= math.sin(CROSSING_RAD) - 1e-9
    best = math.inf
    if cross.any():
        best = _areas(i[cross], j[cross], *(spell[:, cross] for spell in times))
    return best if cross.all() else min(best, _along(a.at(~cross), b.at(~cross)))


def presence(a: Moves, b: Moves) -> tuple[Numbers, Numbers]:
    """Begin and end of a box's contact with another's swept area, as shares of its piece; pair by
    pair.

    Separating axes of a rectangle that moves and a hexagon that stands: the directions of the sides
    of both, of which the sweep has one more. The first is larger than the second where they do not.
    """
    cos_a, sin_a, cos_b, sin_b = (f(m.heading) for m in (a, b) for f in (np.cos, np.sin))
    ux = np.stack([cos_a, -sin_a, cos_b, -sin_b, -b.way_y])
    uy = np.stack([sin_a, cos_a, sin_b, cos_b, b.way_x])
    reach = a.length * np.abs(ux * cos_a + uy * sin_a) + a.width * np.abs(uy * cos_a - ux * sin_a)
    reach += b.length * np.abs(ux * cos_b + uy * sin_b) + b.width * np.abs(uy * cos_b - ux * sin_b)
    where, swept = ux * (b.x - a.x) + uy * (b.y - a.y), ux * b.way_x + uy * b.way_y
    low = where + np.minimum(0.0, swept) - reach / 2.0
    high = where + np.maximum(0.0, swept) + reach / 2.0
    speed = ux * a.way_x + uy * a.way_y
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        ends = low / speed, high / speed
    still, inside = speed == 0.0, (low <= 0.0) & (high >= 0.0)
    enter = np.where(still, np.where(inside, 0.0, math.inf), np.minimum(*ends))
    leave = np.where(still, np.where(inside, 1.0, -math.inf), np.maximum(*ends))
    return np.maximum(0.0, enter.max(axis=0)), np.minimum(1.0, leave.min(axis=0))


def _areas(i: Places, j: Places, mine: Numbers, theirs: Numbers) -> float:
    """The least time between the one's leaving and the other's entering an area [s].

    Args:
        i, j: which pieces cross, shape (n,); those next to each other are of one area.
        mine, theirs: from when until when each body is in what the other's piece sweeps, (2, n).
    """
    from scipy import ndimage  # a fifth of the start of a process that plays

    touched = np.zeros((np.ptp(i) + 1, np.ptp(j) + 1), dtype=bool)
    here = i - i.min(), j - j.min()
    touched[here] = True
    labels, count = ndimage.label(touched, np.ones((3, 3)))
    enter, leave = np.full((2, count), math.inf), np.full((2, count), -math.inf)
    for body, (begin, end) in enumerate((mine, theirs)):
        np.minimum.at(enter[body], labels[here] - 1, begin)
        np.maximum.at(leave[body], labels[here] - 1, end)
    return max(0.0, float((enter[::-1] - leave).max(axis=0).min()))


def _along(a: Moves, b: Moves) -> float:
    """The least time between being in one place for courses that do not cross [s].

    Measured at the ends of the pieces.
    """
    (times, boxes), (others, places) = (
        m.after(share) for m, share in zip((a, b), ENDS, strict=True)
    )
    return float(np.abs(times - others)[boxes_overlap(boxes, places)].min(initial=math.inf))


def boxes_overlap(first: Numbers, second: Numbers) -> NDArray[np.bool_]:
    """Whether boxes overlap or touch, pair by pair; shape (..., 5) each."""
    still = np.zeros((*first.shape[:-1], 2))
    return np.equal(ttc_boxes(first, still, second, still), 0.0)
