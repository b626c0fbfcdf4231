"""Who touches whom: oriented boxes of the ego, the testers and the background traffic.

SUMO misses real overlaps and reports false ones (docs/collisions.md), so contact is decided here,
on the true boxes. Background bodies among themselves are left to SUMO's own reports.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from cavsumo.geometry import gap, overlap
from cavsumo.snapshot import BodyState, Snapshot

# No body is longer than 30 m, so centres farther apart than this on one axis cannot touch.
REACH_M = 32.0


class Contact(NamedTuple):
    """Two bodies beginning to touch."""

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
        min_gap: smallest gap between the ego and a tester so far [m].
    """

    def __init__(self) -> None:
        self.ego_pairs: set[tuple[str, str]] = set()
        self.tester_pairs: set[tuple[str, str]] = set()
        self.min_gap = math.inf
        self._touching: set[tuple[str, str]] = set()

    def observe(self, snapshot: Snapshot) -> list[Contact]:
        """The contacts that begin in this snapshot; one that lasts is reported once."""
        near = _near(snapshot)
        pairs = self._ego_contacts(snapshot, near) + _tester_contacts(snapshot, near)
        touching = {(a.id, b.id) for a, b in pairs}
        begun = [
            Contact(snapshot.time, a, b) for a, b in pairs if (a.id, b.id) not in self._touching
        ]
        self._touching = touching
        for contact in begun:
            with_ego = contact.a is snapshot.ego
            pair = (contact.a.id, contact.b.id)
            (self.ego_pairs if with_ego else self.tester_pairs).add(pair)
        return begun

    def _ego_contacts(
        self, snapshot: Snapshot, near: list[BodyState]
    ) -> list[tuple[BodyState, BodyState]]:
        """The bodies that touch the ego; keeps the smallest gap to a tester."""
        ego = snapshot.ego
        box, touching = ego.box, []
        for tester in snapshot.testers:
            # The gap is at least the distance of the centres less half the boxes' sides.
            distance = math.hypot(tester.x - ego.x, tester.y - ego.y)
            kind = tester.body.kind
            bound = distance - (box.length + box.width + kind.length + kind.width) / 2
            if bound < self.min_gap or bound <= 0.0:
                between = gap(box, tester.box)
                self.min_gap = min(self.min_gap, between)
                if between == 0.0:
                    touching.append((ego, tester))
        touching += [(ego, body) for body in near if overlap(box, body.box)]
        return touching


def _near(snapshot: Snapshot) -> list[BodyState]:
    """The background bodies that the ego or a tester could touch."""
    centres = [(b.x, b.y) for b in (snapshot.ego, *snapshot.testers)]
    return [
        BodyState(*raw)
        for raw in snapshot.raw_background
        if any(abs(raw[1] - x) < REACH_M and abs(raw[2] - y) < REACH_M for x, y in centres)
    ]


def _tester_contacts(
    snapshot: Snapshot, near: list[BodyState]
) -> list[tuple[BodyState, BodyState]]:
    """Testers touching each other or the background."""
    testers = snapshot.testers
    if len(testers) == 1 and not near:
        return []
    boxes = [t.box for t in testers]
    found = [
        (testers[i], testers[j])
        for i in range(len(testers))
        for j in range(i + 1, len(testers))
        if overlap(boxes[i], boxes[j])
    ]
    return found + [
        (tester, body)
        for tester, box in zip(testers, boxes, strict=True)
        for body in near
        if overlap(box, body.box)
    ]
