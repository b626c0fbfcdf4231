"""How critical an episode became: smallest TTC, largest DRAC, post-encroachment time.

Of the ego and the testers, pedestrians too, until the first contact between them. The snapshots are
kept while the episode goes on and measured once, at its end. An exact time to collision costs ten
times as much as one of the circles around two bodies, which it is never below: so these come first,
and the boxes only of those that could still be the most critical. Of two tracks only places near
each other are compared. ``metrics`` has the same for arrays, without bounds.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from itertools import compress
from typing import NamedTuple

from cavsumo.contacts import STANDING_MPS, Contact
from cavsumo.geometry import overlap
from cavsumo.snapshot import BodyState, Snapshot

HORIZON_S = 10.0  # what lies farther ahead, or farther apart, is not critical
Track = list[tuple[float, BodyState]]  # where a body was when; while it stands only the ends
# A lower bound of the time to collision, the closing speed along the ego's heading, the two.
Pair = tuple[float, float, BodyState, BodyState]


class Extremes(NamedTuple):
    """The extremes of an episode; infinite, or 0 for the deceleration, where nothing was near."""

    ttc: float  # smallest time to collision while the ego moves [s]
    drac: float  # largest deceleration by which the ego just avoids a collision [m/s2]
    pet: float  # smallest post-encroachment time, 0 with a contact [s]


class Course:
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
    best, ego = math.inf, None
    times = [s.time for s in kept]
    for i, first in enumerate(kept[0].testers if kept else ()):
        if kept[-1].testers[i] is not first:  # else it stood where it stood
            ego = ego or track(times, [s.ego for s in kept])
            best = min(best, pet(ego, track(times, [s.testers[i] for s in kept])))
    return best


def track(times: Sequence[float], states: Sequence[BodyState]) -> Track:
    """Where a body was; of the time that it stands in one place only the first and the last."""
    places = [state[1:3] for state in states]
    around = zip([None, *places], places, [*places[1:], None], strict=False)
    ends = [here != before or here != after for before, here, after in around]
    return list(compress(zip(times, states, strict=True), ends))


def pet(first: Track, second: Track) -> float:
    """Post-encroachment time of two tracks within ``HORIZON_S``, else infinite [s].

    The same as ``metrics.encroachment.pet_tracks``. Far from the first track the second body is
    looked at again when it has gone far enough to be near.
    """
    reach = first[0][1].body.kind.reach + second[0][1].body.kind.reach
    places = [(state[1], state[2]) for _, state in first]
    times = [t for t, _ in first]
    stride = max(map(math.dist, places, places[1:]), default=1.0) or 1.0
    x0 = y0 = math.inf
    best, leeway, here, hypot = HORIZON_S + 1e-9, 0.0, -1, math.hypot
    for time, state in second:
        x, y = state[1], state[2]
        if here < 0:
            if hypot(x - x0, y - y0) < leeway:
                continue
            far = [hypot(px - x, py - y) for px, py in places]
            least = min(far)
            x0, y0, leeway = x, y, least - reach
            if leeway > 0.0:
                continue
            here = far.index(least)
        # Only who was there less than the best time before or after can be better.
        begin, end = bisect_left(times, time - best), bisect_right(times, time + best)
        near = list(_near(places, x, y, reach, stride, here, begin, end))
        for i in near:
            if abs(times[i] - time) < best:
                best = _meeting(first[i], (time, state), best)
        if near:
            here = near[len(near) // 2]
        elif begin <= here < end:
            here = -1
    return best if best <= HORIZON_S else math.inf


def _near(
    places: Sequence[tuple[float, float]],
    x: float,
    y: float,
    reach: float,
    stride: float,
    here: int,
    begin: int,
    end: int,
) -> Iterator[int]:
    """The places from ``begin`` to ``end`` within reach of a point, from one of them on.

    Places that follow each other are at most a stride apart, so some can be left out.
    """
    here = max(begin, min(here, end))
    for k, way in ((here, 1), (here - 1, -1)):
        while begin <= k < end:
            px, py = places[k]
            beyond = math.hypot(px - x, py - y) - reach
            if beyond <= 0.0:
                yield k
                k += way
            else:
                k += way * (int(beyond / stride) or 1)


def _meeting(one: tuple[float, BodyState], two: tuple[float, BodyState], best: float) -> float:
    """The time between two bodies being in one place, or what was best so far."""
    (then, a), (now, b) = one, two
    across = (b.x - a.x) * math.sin(a.o) - (b.y - a.y) * math.cos(a.o)
    if abs(across) > a.body.kind.width / 2 + b.body.kind.reach or not overlap(a.box, b.box):
        return best
    return abs(then - now)
