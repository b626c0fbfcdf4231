"""Validity of tests: whether the testers obey the rules of the simulated world.

An episode is invalid if the body that the verdict names broke a rule before it, or any body at the
start. An episode without a test cannot be invalid: it stays in the rates, or agents would be
rewarded for wasting it. A body must not, before the verdict:

* start in another body;
* get into another body deeper than people and vehicles can. The depth of a pair is measured once,
  in full, and grows while a tester of the pair moves. Of two testers both are responsible, or
  bodies would pass through each other in a valid test; a standing tester is not responsible for
  other bodies, so background traffic that does not see it has no consequence;
* get into the standing ego and still be there when that drives on;
* leave the world: on foot farther than STRAY_M from carriageways and pavements, vehicles farther
  than OFF_ROAD_M from the carriageway, unless at the end of its way out of the network;
* move as its kind cannot. Actions cannot do that, but states set directly could.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from cavsumo.agents.walking import turn_limit
from cavsumo.assertions.base import NOT_TRIGGERED, Judgement
from cavsumo.assertions.contacts import STANDING_MPS, Pair, depth
from cavsumo.model.bodies import WALKING, Kind
from cavsumo.model.carriageway import Roads
from cavsumo.model.cells import Cells
from cavsumo.model.kinematics import wrap
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.network.pedestrian_starts import NEAR_M

# How deep one body may get into another [m], by how many of the two are pedestrians of the testers:
# their box, 0.66 m by 0.88 m, is larger than a person, who brushes past others.
DEEP_M = {2: 0.3, 1: 0.15, 0: 0.1}
STARTS_IN = "starts in"
STRAY_M = NEAR_M  # a tester on a pavement so far from the road may cross the verge between them
OFF_ROAD_M = 1.0
ROUNDING = 1e-6  # m, m/s, rad


class Breach(NamedTuple):
    """A rule of the world, broken."""

    time: float  # s
    tester: str
    what: str

    def __str__(self) -> str:
        return f"{self.tester} {self.what} at {self.time:.1f} s"


class ValidityMonitor:
    """Follows one episode.

    Attributes:
        breaches: the first one of each tester's body, in the order in which they came.
    """

    def __init__(self, scene: Scene) -> None:
        self.breaches: dict[str, Breach] = {}
        self._scene = scene
        self._index = {body.id: i for i, body in enumerate(scene.bodies)}
        self._testers: tuple[BodyState, ...] = ()
        # For each pair that touches: the counted part of its depth, and its depth [m].
        self._depths: dict[tuple[str, str], tuple[float, float]] = {}
        # The last place checked for each body, and the distance from there within which it is
        # valid.
        self._known = [(math.inf, math.inf, 0.0)] * len(scene.bodies)
        roads = scene.roads
        self._worlds = [None if roads is None else _world(roads, b.kind) for b in scene.bodies]

    def observe(self, snapshot: Snapshot, pairs: Sequence[Pair]) -> None:
        """Take in a snapshot and the pairs that touch in it."""
        if snapshot.step == 0:
            self._look_at_starts(snapshot, pairs)
        elif pairs or self._depths:
            self._look_at_pairs(snapshot, pairs)
        if snapshot.testers is not self._testers:  # or they all stand where they stood
            self._look_at_moves(snapshot)
            self._testers = snapshot.testers

    def _report(self, snapshot: Snapshot, tester: str, what: str) -> None:
        """The first breach of each body stands."""
        self.breaches.setdefault(tester, Breach(snapshot.time, tester, what))

    @property
    def first(self) -> Breach | None:
        """The first breach of all."""
        return next(iter(self.breaches.values()), None)

    def spoils(self, judgement: Judgement) -> Breach | None:
        """The breach that makes an episode with this judgement invalid."""
        first = self.first
        if first is None or first.what.startswith(STARTS_IN):
            return first
        if judgement.verdict == NOT_TRIGGERED:
            return None
        # If a verdict names no tester, the breach of any tester counts.
        return self.breaches.get(judgement.tester) if judgement.tester in self._index else first

    def _look_at_starts(self, snapshot: Snapshot, pairs: Sequence[Pair]) -> None:
        """Whether a tester starts in another body; touching the ego is enough."""
        for a, b in pairs:
            tester, other = (a, b) if a.id in self._index else (b, a)
            with_ego, deep = other is snapshot.ego, _depth(tester, other)
            self._depths[a.id, b.id] = deep, deep
            if tester.id in self._index and (with_ego or deep > _allowed(a, b)):
                self._report(snapshot, tester.id, f"{STARTS_IN} {other.id}")

    def _look_at_pairs(self, snapshot: Snapshot, pairs: Sequence[Pair]) -> None:
        """Measure the depth of each pair once, and report pairs that are too deep."""
        before, self._depths = self._depths, {}
        standing = snapshot.ego.v <= STANDING_MPS
        for a, b in pairs:
            with_ego, deep = a is snapshot.ego, _depth(a, b)
            counted, was = before.get((a.id, b.id), (0.0, 0.0))
            movers = [s for s in (a, b) if self._moved(s)]
            if movers and (standing or not with_ego):
                counted += max(0.0, deep - was)
            counted = min(counted, deep)
            self._depths[a.id, b.id] = counted, deep
            if counted > _allowed(a, b) and not (with_ego and standing):
                self._report_pair(snapshot, a, b)

    def _moved(self, state: BodyState) -> bool:
        """Whether a body is a tester that has moved."""
        i = self._index.get(state.id)
        return i is not None and state[1:] != self._testers[i][1:]

    def _report_pair(self, snapshot: Snapshot, a: BodyState, b: BodyState) -> None:
        """The testers of a pair that is too deep in each other, those that moved first."""
        testers = [(one, other) for one, other in ((a, b), (b, a)) if one.id in self._index]
        for one, other in sorted(testers, key=lambda pair: not self._moved(pair[0])):
            stood = len(testers) > 1 and not self._moved(one)
            what = f"stood in the way of {other.id}" if stood else f"moved into {other.id}"
            self._report(snapshot, one.id, what)

    def _look_at_moves(self, snapshot: Snapshot) -> None:
        """Whether a tester left the world or moved as it cannot."""
        dt = self._scene.dt
        for i, body in enumerate(snapshot.testers):
            before = self._testers[i] if self._testers else None
            if before is body or body.body.id in self.breaches:
                continue  # it stands, or broke a rule already
            if before is not None and not possible(before, body, dt):
                self._report(snapshot, body.id, f"moved as no {body.body.kind.name} can")
            x, y, leeway = self._known[i]
            if math.hypot(body.x - x, body.y - y) >= leeway and not self._in_world(i, body):
                self._report(snapshot, body.id, "left the world")

    def _in_world(self, i: int, body: BodyState) -> bool:
        """Whether a body is inside the world."""
        world = self._worlds[i]
        inside, room = (True, math.inf) if world is None else world.at(body.x, body.y)
        self._known[i] = body.x, body.y, room if inside else 0.0
        return inside or self._drives_out(i, body)

    def _drives_out(self, i: int, body: BodyState) -> bool:
        """Whether a vehicle is beyond the end of its way, where the network ends."""
        approach = self._scene.starts[i].approach
        if approach is None:
            return False
        return approach.path.project(body.x, body.y).along >= approach.path.length - OFF_ROAD_M


def _world(roads: Roads, kind: Kind) -> Cells:
    """Whether places are inside the world of a kind of body."""
    on_foot = _walks(kind)
    return roads.within(STRAY_M if on_foot else OFF_ROAD_M, on_foot=on_foot)


def possible(before: BodyState, after: BodyState, dt: float) -> bool:
    """Whether a body can have moved so in one timestep (seed, eqs 8 to 19)."""
    kind, v = before.body.kind, before.v
    way = math.hypot(after.x - before.x, after.y - before.y)
    gained = after.v - v
    return (
        way <= abs(v) * dt + ROUNDING
        and kind.v_min - ROUNDING <= after.v <= max(kind.v_max, v) + ROUNDING
        and gained <= kind.throttle_max * dt + ROUNDING
        and (gained >= kind.throttle_min * dt - ROUNDING or after.v >= kind.v_max)
        and (
            after.o == before.o
            or abs(wrap(after.o - before.o)) <= turn_limit(kind, abs(v), dt) + ROUNDING
        )
    )


def _depth(a: BodyState, b: BodyState) -> float:
    """How deep two bodies are in each other [m]."""
    return depth(a.box, b.box)


def _allowed(a: BodyState, b: BodyState) -> float:
    """How deep they may get [m]."""
    return DEEP_M[_walks(a.body.kind) + _walks(b.body.kind)]


def _walks(kind: Kind) -> bool:
    """Whether a kind is on foot; SUMO's own persons have boxes of their true size."""
    return kind.name in WALKING
