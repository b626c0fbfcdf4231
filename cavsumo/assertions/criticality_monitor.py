"""How critical an episode became: smallest TTC, largest DRAC, post-encroachment time.

Of the ego and the testers, pedestrians too, until the first contact between them. The snapshots are
kept while the episode goes on and measured once, at its end. An exact time to collision costs ten
times as much as one of the circles around two bodies, which it is never below: so these come
first, and the boxes only of those that could still be the most critical. Of two tracks only parts
near each other are compared. ``metrics`` has the same for arrays, without bounds.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cavsumo.assertions.contacts import STANDING_MPS, Contact
from cavsumo.assertions.metrics.encroachment import ROUNDING_M, moves, near, pet_moves
from cavsumo.model.snapshot import BodyState, Snapshot

HORIZON_S = 10.0  # what lies farther ahead, or farther apart, is not critical
STRETCH = 8  # moments of a track that are looked at together
Track = list[tuple[float, BodyState]]  # where a body was when; while it stands only the ends
# A lower bound of the time to collision, the closing speed along the ego's heading, the two.
Pair = tuple[float, float, BodyState, BodyState]


class Extremes(NamedTuple):
    """The extremes of an episode; infinite, or 0 for the deceleration, where nothing was near."""

    ttc: float = math.inf  # smallest time to collision while the ego moves [s]
    drac: float = 0.0  # largest deceleration by which the ego just avoids a collision [m/s2]
    pet: float = math.inf  # smallest post-encroachment time, 0 with a contact [s]


class CriticalityMonitor:
    """What happened between the ego and the testers, until they first touch."""

    def __init__(self) -> None:
        self._kept: list[Snapshot] = []
        self._touched = False

    def observe(self, snapshot: Snapshot, contacts: Sequence[Contact]) -> None:
        """Take in a snapshot and the contacts that begin in it."""
        if self._touched:
            return
        if contacts and any(c.a is snapshot.ego and c.b in snapshot.testers for c in contacts):
            self._touched = True
            return
        self._kept.append(snapshot)

    def extremes(self) -> Extremes:
        """The extremes so far."""
        pairs = converging(self._kept)
        pet = 0.0 if self._touched else _smallest_pet(self._kept)
        return Extremes(_smallest_ttc(pairs), _largest_drac(pairs), pet)


def converging(kept: Sequence[Snapshot]) -> list[Pair]:
    """The moving ego and testers whose circles meet within ``HORIZON_S`` if they keep their course.

    Two circles that move meet if the line of their relative motion passes close enough.
    """
    pairs: list[Pair] = []
    sqrt, cos, sin = math.sqrt, math.cos, math.sin
    for snapshot in kept:
        ego = snapshot.ego
        body, x, y, v, o = ego
        if v <= STANDING_MPS:
            continue
        ahead, left, own = cos(o), sin(o), body.kind.reach
        c, s = v * ahead, v * left
        for tester in snapshot.testers:
            other, there_x, there_y, speed, heading = tester
            wx, wy, square = c, s, v * v
            if speed:
                wx, wy = c - speed * cos(heading), s - speed * sin(heading)
                square = wx * wx + wy * wy
            dx, dy, reach = there_x - x, there_y - y, own + other.kind.reach
            passes, nearing = dx * wy - dy * wx, dx * wx + dy * wy
            room = reach * reach * square - passes * passes
            # Centres that part already may have corners still to meet, while the circles overlap.
            if room >= 0.0 and square > 0.0 and nearing >= -sqrt(room):
                least = (nearing - sqrt(room)) / square
                if least <= HORIZON_S:
                    pairs.append((max(0.0, least), wx * ahead + wy * left, ego, tester))
    return pairs


def _smallest_ttc(pairs: Sequence[Pair]) -> float:
    """The smallest time to collision within ``HORIZON_S`` [s]."""
    best = math.inf
    for least, _, ego, tester in sorted(pairs, key=lambda pair: pair[0]):
        if least >= best:
            break
        time = ttc(ego, tester)
        if time <= HORIZON_S:
            best = min(best, time)
    return best


def _largest_drac(pairs: Sequence[Pair]) -> float:
    """The largest deceleration to avoid a collision within ``HORIZON_S`` [m/s2]."""
    best = 0.0
    closing = [pair for pair in pairs if pair[1] > 0.0]
    closing.sort(key=lambda pair: pair[1] / max(pair[0], 1e-9), reverse=True)
    for least, speed, ego, tester in closing:
        if speed <= best * 2.0 * least:
            break
        time = ttc(ego, tester)
        if time <= HORIZON_S:
            best = max(best, speed / (2.0 * time) if time > 0.0 else math.inf)
    return best


def ttc(first: BodyState, second: BodyState) -> float:
    """Time until two bodies touch at constant velocities, as ``metrics.plane.ttc_boxes`` [s]."""
    dx, dy = second.x - first.x, second.y - first.y
    wx = second.v * math.cos(second.o) - first.v * math.cos(first.o)
    wy = second.v * math.sin(second.o) - first.v * math.sin(first.o)
    turn = second.o - first.o
    c, s = abs(math.cos(turn)), abs(math.sin(turn))
    begin, end = 0.0, math.inf
    for one, other in ((first, second), (second, first)):
        a, b, ux, uy = one.body.kind, other.body.kind, math.cos(one.o), math.sin(one.o)
        along = (a.length + b.length * c + b.width * s) / 2.0
        across = (a.width + b.length * s + b.width * c) / 2.0
        for where, speed, reach in (
            (dx * ux + dy * uy, wx * ux + wy * uy, along),
            (dy * ux - dx * uy, wy * ux - wx * uy, across),
        ):
            if speed == 0.0:
                if abs(where) > reach:
                    return math.inf
                continue
            enter, leave = (-reach - where) / speed, (reach - where) / speed
            begin, end = max(begin, min(enter, leave)), min(end, max(enter, leave))
    return begin if begin <= end else math.inf


def _smallest_pet(kept: Sequence[Snapshot]) -> float:
    """Smallest post-encroachment time of the ego and a tester that moved [s]."""
    if not kept:
        return math.inf
    last = zip(kept[0].testers, kept[-1].testers, strict=True)
    moved = [i for i, (one, other) in enumerate(last) if one is not other]
    if not moved:  # they stood where they stood
        return math.inf
    times = [s.time for s in kept]
    reach = kept[0].ego.body.kind.reach + max(t.body.kind.reach for t in kept[0].testers)
    first = stretches(track(times, [s.ego for s in kept]), reach + ROUNDING_M)
    return pet(first, *(track(times, [s.testers[i] for s in kept]) for i in moved))


def track(times: Sequence[float], states: Sequence[BodyState]) -> Track:
    """Where a body was; of the time that it stands in one place only the first and the last."""
    found: Track = []
    x = y = math.nan
    stood = None  # the last moment, if it is where the one before was
    for moment in zip(times, states, strict=True):
        _, here, there, _, _ = moment[1]
        if here == x and there == y:
            stood = moment
            continue
        if stood:
            found.append(stood)
            stood = None
        found.append(moment)
        x, y = here, there
    return [*found, stood] if stood else found


class Stretch(NamedTuple):
    """The rectangle, along the axes, in which the centres of a part of a track lie [m]."""

    low_x: float
    high_x: float
    low_y: float
    high_y: float


class Stretched(NamedTuple):
    """A track with the rectangles of its parts, ``STRETCH`` moments each and the next."""

    track: Track
    parts: list[Stretch]


def stretches(track: Track, reach: float) -> Stretched:
    """A track in parts, their rectangles wider by a reach on each side."""
    _, xs, ys, _, _ = zip(*(state for _, state in track), strict=True)
    found = []
    for i in range(0, max(1, len(track) - 1), STRETCH):
        x, y = xs[i : i + STRETCH + 1], ys[i : i + STRETCH + 1]
        found.append(Stretch(min(x) - reach, max(x) + reach, min(y) - reach, max(y) + reach))
    return Stretched(track, found)


def pet(first: Stretched, *others: Track) -> float:
    """Least post-encroachment time of a track and others within ``HORIZON_S``, else infinite [s].

    The same as ``metrics.encroachment.pet_tracks``. Only pieces that come near each other are
    compared, those of all others at once, which saves more time than the comparison takes.

    Args:
        first: the stretches of a track, with the reach of both bodies.
        others: the other tracks.
    """
    meetings = [(t, _meetings(first.parts, stretches(t, 0.0).parts)) for t in others]
    meetings = [(t, met) for t, met in meetings if met]
    if not meetings:
        return math.inf
    low, mine = _rows(first.track, [one for _, met in meetings for one, _ in met])
    rows, near_by = list(mine), []
    for other, met in meetings:
        lower, theirs = _rows(other, [there for _, there in met])
        parts = [(one - low, there - lower) for one, there in met]
        near_by.append(_compared(parts, len(mine), len(theirs)))
        rows += theirs
    table = np.array(rows)
    pieces = moves(table[:, 0], table[:, 1:])
    own = int(np.searchsorted(pieces.moment, len(mine)))
    here, there = pieces.moment[:own], pieces.moment[own:] - len(mine)
    i, j = np.nonzero(np.hstack(near_by)[here][:, there])
    best = pet_moves(pieces, pieces, *near(pieces, pieces, i, j + own))
    return best if best <= HORIZON_S else math.inf


def _compared(parts: Iterable[tuple[int, int]], mine: int, theirs: int) -> NDArray[np.bool_]:
    """Which moments of two tracks to compare, of the parts that meet, shape (mine, theirs)."""
    found = np.zeros((mine, theirs), dtype=bool)
    for one, other in parts:
        i, j = STRETCH * one, STRETCH * other
        found[i : i + STRETCH, j : j + STRETCH] = True
    found[-1] = found[:, -1] = False  # from there a piece leads to another track
    return found


def _rows(track: Track, parts: Sequence[int]) -> tuple[int, list[tuple[float, ...]]]:
    """The first of these parts of a track, and all moments up to the last, of which that twice."""
    low = min(parts)
    moments = track[STRETCH * low : STRETCH * (max(parts) + 1) + 1]
    kind = track[0][1].body.kind
    size = kind.length, kind.width
    rows = [(time, x, y, o, *size) for time, (_, x, y, _, o) in moments]
    return low, [*rows, rows[-1]]


def _meetings(first: Sequence[Stretch], second: Sequence[Stretch]) -> list[tuple[int, int]]:
    """Which rectangles overlap."""
    found = []
    low_xs, high_xs, low_ys, high_ys = zip(*second, strict=True)
    low_x, high_x, low_y, high_y = min(low_xs), max(high_xs), min(low_ys), max(high_ys)
    for i, (x0, x1, y0, y1) in enumerate(first):
        if x0 <= high_x and low_x <= x1 and y0 <= high_y and low_y <= y1:  # one of them may
            for j, (u0, u1, w0, w1) in enumerate(second):
                if x0 <= u1 and u0 <= x1 and y0 <= w1 and w0 <= y1:
                    found.append((i, j))
    return found
