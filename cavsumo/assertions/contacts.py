"""Contacts between the oriented boxes of the ego, the testers and the background traffic.

SUMO misses real overlaps and reports false ones (docs/collisions.md), so contact is decided here,
on the true boxes. Background bodies among themselves are left to SUMO's own reports.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from cavsumo.model.geometry import Box, gap, overlap
from cavsumo.model.snapshot import BodyState, RawState, Snapshot

# Below this speed the ego stands: a body that touches it then has moved into it [m/s].
STANDING_MPS = 0.1
KEPT = 64  # candidates for the smallest gap before the list is reduced


Pair = tuple[BodyState, BodyState]
Around = tuple[float, float, float, float]  # an upright box: its middle and half its sides [m]


class Contact(NamedTuple):
    """Two bodies beginning to touch, or the ego driving on into one that touched it standing."""

    time: float  # s
    a: BodyState  # the ego when it is involved, else a tester
    b: BodyState

    @property
    def closing_speed(self) -> float:
        """Their relative speed along the heading of the first [m/s]."""
        return self.a.v - self.b.v * math.cos(self.b.o - self.a.o)


class ContactMonitor:
    """Follows one episode.

    Attributes:
        ego_pairs, tester_pairs: the pairs that touched so far, with the ego and without it.
        pairs: those that touch now.
    """

    def __init__(self) -> None:
        self.ego_pairs: set[tuple[str, str]] = set()
        self.tester_pairs: set[tuple[str, str]] = set()
        self.pairs: list[Pair] = []
        self._touching: set[tuple[str, str]] = set()
        self._touched_standing: set[tuple[str, str]] = set()
        # Candidates for the smallest gap: with its lower bound, those below any upper bound.
        self._close: list[tuple[float, BodyState, BodyState]] = []
        self._upper = math.inf
        self._testers: tuple[BodyState, ...] = ()
        self._among: list[Pair] = []  # those among these testers that touch
        self._around = _box_around(())

    @property
    def min_gap(self) -> float:
        """Smallest gap between the ego and a tester so far [m]; infinite without testers."""
        smallest = math.inf
        for lower, ego, tester in sorted(self._close, key=_lower):
            if lower >= smallest:
                break
            smallest = min(smallest, gap(ego.box, tester.box))
        return smallest

    def observe(self, snapshot: Snapshot) -> list[Contact]:
        """The contacts that begin in this snapshot; one that lasts is reported once."""
        pairs = self._meetings_with_ego(snapshot)
        pairs += self._meetings_of_testers(snapshot)
        self.pairs = pairs
        if not pairs and not self._touching:
            return []
        standing = snapshot.ego.v <= STANDING_MPS
        begun = [
            Contact(snapshot.time, a, b)
            for a, b in pairs
            if (a.id, b.id) not in self._touching
            or (not standing and (a.id, b.id) in self._touched_standing)
        ]
        self._touching = {(a.id, b.id) for a, b in pairs}
        self._touched_standing = {
            pair for pair in self._touching if standing and pair[0] == snapshot.ego.id
        }
        for contact in begun:
            involved = self.ego_pairs if contact.a is snapshot.ego else self.tester_pairs
            involved.add((contact.a.id, contact.b.id))
        return begun

    def _meetings_with_ego(self, snapshot: Snapshot) -> list[Pair]:
        """The bodies that touch the ego; keeps the smallest gap to a tester."""
        ego = snapshot.ego
        body, x, y, _, _ = ego
        own = body.kind.reach
        pairs: list[Pair] = []
        hypot, upper = math.hypot, self._upper
        for tester in snapshot.testers:
            other, there_x, there_y, _, _ = tester
            distance = hypot(there_x - x, there_y - y)
            reach = own + other.kind.reach
            if distance - reach < upper:
                self._note(distance, distance - reach, ego, tester)
                upper = self._upper
                if distance <= reach and overlap(ego.box, tester.box):
                    pairs.append((ego, tester))
        if snapshot.raw_background:
            pairs += [(ego, other) for other in _touching(ego, snapshot.raw_background)]
        return pairs

    def _meetings_of_testers(self, snapshot: Snapshot) -> list[Pair]:
        """Testers touching the background or each other."""
        testers, background = snapshot.testers, snapshot.raw_background
        if testers is not self._testers:  # or all stand still
            self._testers, self._among = testers, _meetings_among(testers)
            self._around = _box_around(testers)
        if not background:
            return self._among
        near = _within(self._around, background)
        if not near:
            return self._among
        return [(t, other) for t in testers for other in _touching(t, near)] + self._among

    def _note(self, distance: float, lower: float, ego: BodyState, tester: BodyState) -> None:
        """Remember two bodies that may be the closest so far; exact gaps are dear.

        The gap lies between the centres' distance less the boxes' reaches and the same less
        their inner radii, so most timesteps are ruled out by a later, closer one.
        """
        if ego.v == 0.0 and self._close:
            _, before, met = self._close[-1]
            if met is tester and before[1:] == ego[1:]:
                return  # both stand
        upper = distance - ego.body.kind.inner - tester.body.kind.inner
        if upper < self._upper:
            self._upper = upper if upper > 0.0 else 0.0
        self._close.append((lower, ego, tester))
        if len(self._close) > KEPT:
            self._close = [c for c in self._close if c[0] <= self._upper]


def depth(a: Box, b: Box) -> float:
    """How far the boxes must be moved to part [m]; 0 if they are apart (separating axes)."""
    dx, dy, turn = b.x - a.x, b.y - a.y, b.heading - a.heading
    c, s = abs(math.cos(turn)), abs(math.sin(turn))
    along = 0.5 * (a.length + b.length * c + b.width * s)
    across = 0.5 * (a.width + b.length * s + b.width * c)
    other_along = 0.5 * (b.length + a.length * c + a.width * s)
    other_across = 0.5 * (b.width + a.length * s + a.width * c)
    ca, sa, cb, sb = (f(o) for o in (a.heading, b.heading) for f in (math.cos, math.sin))
    return max(
        0.0,
        min(
            along - abs(dx * ca + dy * sa),
            across - abs(dy * ca - dx * sa),
            other_along - abs(dx * cb + dy * sb),
            other_across - abs(dy * cb - dx * sb),
        ),
    )


def _lower(candidate: tuple[float, BodyState, BodyState]) -> float:
    """The lower bound of a gap."""
    return candidate[0]


def _meetings_among(testers: tuple[BodyState, ...]) -> list[Pair]:
    """Testers touching each other."""
    pairs: list[Pair] = []
    for i, tester in enumerate(testers[1:], 1):
        x, y, reach = tester.x, tester.y, 2 * tester.body.kind.reach
        pairs += [
            (other, tester)
            for other in testers[:i]
            if abs(other.x - x) <= reach and abs(other.y - y) <= reach
            if overlap(other.box, tester.box)
        ]
    return pairs


def _touching(one: BodyState, others: Sequence[RawState]) -> list[BodyState]:
    """Those among the others whose boxes touch one body's."""
    body, x, y, _, _ = one
    near = _within((x, y, body.kind.reach, body.kind.reach), others)
    return [state for state in map(BodyState._make, near) if overlap(one.box, state.box)]


def _box_around(bodies: Sequence[BodyState]) -> Around:
    """The upright box around bodies in any direction; none around no body."""
    if not bodies:
        return 0.0, 0.0, -math.inf, -math.inf
    reach = max([body.kind.reach for body, *_ in bodies])
    xs, ys = [state[1] for state in bodies], [state[2] for state in bodies]
    left, right, low, high = min(xs), max(xs), min(ys), max(ys)
    half_x, half_y = (right - left) / 2 + reach, (high - low) / 2 + reach
    # a nanometre for the rounding of the middle
    return (left + right) / 2, (low + high) / 2, half_x + 1e-9, half_y + 1e-9


def _within(around: Around, others: Sequence[RawState]) -> list[RawState]:
    """Those that may touch an upright box: one axis alone rules most bodies out."""
    x, y, half_x, half_y = around
    return [
        other
        for other in others
        if abs(other[1] - x) <= half_x + other[0].kind.reach
        and abs(other[2] - y) <= half_y + other[0].kind.reach
    ]
