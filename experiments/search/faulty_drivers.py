"""Faulty drivers: a careful controller, and variants of it with one fault each.

The careful driver decides in every timestep. It yields to everybody on the road whose course meets
its own, or who is within a metre of its way, and stops before them. ``FAULTS`` lists the variants;
each is a class of this module::

    PYTHONPATH=experiments/search cavsumo search --ego faulty_drivers:TrustsTheLeaving
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace

from cavsumo.egos import Acceleration
from cavsumo.egos.reference.encounter import Encounter, encounter
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

SPEED_MPS, ACCEL_MPS2, HARDEST_MPS2 = 8.33, 1.5, 9.0
ROOM_M, STOP_M = 1.0, 1.5  # beside its way, and to the body before which it stops


@dataclass(frozen=True)
class Ability:
    """How a driver perceives, predicts, decides and acts; the defaults are the careful ones."""

    # perception
    sight_m: float = 80.0
    half_view_rad: float = math.pi
    every_s: float = 0.0  # looks so often
    lag_s: float = 0.0  # sees the others where they were
    slowest_mps: float = 0.0  # does not notice slower bodies
    shrinks: bool = False  # takes everybody for a point
    nearest_only: bool = False
    hidden_rad: float = 0.0  # loses sight of bodies so near to the direction of a nearer one
    recognises_s: float = 0.0  # notices them again so long after that
    groups_m: float = 0.0  # takes bodies so near to a nearer one for that one
    blind_left: bool = False
    aside_m: float = 0.0  # sees everybody so much farther beside its way
    # prediction
    horizon_s: float = math.inf
    room_m: float = ROOM_M
    trusts_standing_s: float = 0.0  # who stood beside its way stays there for so long
    trusts_oncoming: bool = False  # those who come towards it step aside
    trusts_leaving_s: float = 0.0  # who has left its way does not come back for so long
    stops_at_lane: bool = False  # whoever is not in its way yet will wait
    # decision
    delay_s: float = 0.0
    latest_ttc_s: float = math.inf
    gambles_s: float = 0.0  # passes before somebody who comes no more than so much too early
    forgives: bool = False  # yields to each body once
    # action
    decel: float = HARDEST_MPS2
    jerk: float = math.inf
    lets_go_s: float = math.inf  # brakes no longer than this
    creeps_mps: float = 0.0
    # the test
    testers: int = 1  # with fewer pedestrians there is no fault


class Driver:
    """A driver of some ability."""

    ability = Ability()
    depart_speed = SPEED_MPS

    def reset(self, scene: Scene) -> None:
        """Begin an episode."""
        self.scene = scene
        self._past: deque[Snapshot] = deque(maxlen=1 + round(self.ability.lag_s / scene.dt))
        self._seen: Snapshot | None = None
        self._alarms: deque[bool] = deque(maxlen=1 + round(self.ability.delay_s / scene.dt))
        self._hidden: dict[str, float] = {}
        self._left: dict[str, float] = {}
        self._stood: dict[str, float] = {}
        self._yielded: set[str] = set()
        self._yielding: set[str] = set()
        self._braked, self._brake = 0.0, 0.0

    def act(self, snapshot: Snapshot) -> Acceleration:
        """The acceleration now."""
        able, v = self.ability, snapshot.ego.v
        seen = self._look(snapshot)
        asked = [a for body in seen if (a := self._asked(snapshot, body)) is not None]
        self._alarms.append(bool(asked))
        if not asked or not self._alarms[0]:
            self._braked = self._brake = 0.0
            return Acceleration(min(ACCEL_MPS2, (SPEED_MPS - v) / self.scene.dt))
        self._braked += self.scene.dt
        if self._braked > able.lets_go_s:
            return Acceleration(0.0)
        wanted = min(able.decel, max(asked))
        self._brake = min(wanted, self._brake + able.jerk * self.scene.dt)
        return Acceleration(-min(self._brake, max(0.0, v - able.creeps_mps) / self.scene.dt))

    def _look(self, snapshot: Snapshot) -> list[BodyState]:
        """The bodies that it perceives, where it believes them."""
        able = self.ability
        self._past.append(snapshot)
        due = self._seen is None or snapshot.time - self._seen.time >= able.every_s - 1e-9
        self._seen = self._past[0] if due else self._seen
        assert self._seen is not None
        ego = snapshot.ego
        bodies = [*self._seen.testers, *self._seen.background]
        bodies = [b for b in bodies if self._notices(ego, b)]
        bodies.sort(key=lambda b: math.dist((b.x, b.y), (ego.x, ego.y)))
        if able.hidden_rad:
            bodies = [b for i, b in enumerate(bodies) if self._recognises(snapshot, b, bodies[:i])]
        if able.groups_m:
            bodies = [b for i, b in enumerate(bodies) if not _near(b, bodies[:i], able.groups_m)]
        return bodies[:1] if able.nearest_only else bodies

    def _recognises(self, snapshot: Snapshot, body: BodyState, nearer: list[BodyState]) -> bool:
        """Whether no nearer body hides a body, nor has done so shortly before."""
        able, bearing = self.ability, _bearing(snapshot.ego, body)
        apart = [abs(math.remainder(bearing - _bearing(snapshot.ego, b), math.tau)) for b in nearer]
        if min(apart, default=math.inf) < able.hidden_rad:
            self._hidden[body.id] = snapshot.time
        since = snapshot.time - self._hidden.get(body.id, -math.inf)
        return since >= able.recognises_s

    def _notices(self, ego: BodyState, body: BodyState) -> bool:
        """Whether it notices a body."""
        able = self.ability
        dx, dy = body.x - ego.x, body.y - ego.y
        bearing = math.remainder(_bearing(ego, body) - ego.o, math.tau)
        return (
            math.hypot(dx, dy) <= able.sight_m
            and abs(bearing) <= able.half_view_rad
            and body.v >= able.slowest_mps
            and not (able.blind_left and 0.1 < bearing < 1.2)
        )

    def _asked(self, snapshot: Snapshot, body: BodyState) -> float | None:
        """The deceleration that a body asks for [m/s2]; None for none."""
        able, name = self.ability, body.id
        if able.shrinks:
            kind = replace(body.body.kind, length=0.01, width=0.01)
            body = body._replace(body=body.body._replace(kind=kind))
        met = encounter(self.scene, snapshot, body)
        met = met._replace(beside=met.beside + able.aside_m)
        if not self._heeds(snapshot, name, met):
            if name in self._yielding:
                self._yielded.add(name)
            return None
        self._yielding.add(name)
        v, room = snapshot.ego.v, met.gap - STOP_M
        if met.gap <= 0.0 or room <= 0.0:
            return HARDEST_MPS2
        needed = max(0.0, v - max(0.0, met.onward)) ** 2 / (2.0 * room)
        return HARDEST_MPS2 if needed > 3.0 else (needed if needed > 0.8 else 0.0)

    def _heeds(self, snapshot: Snapshot, name: str, met: Encounter) -> bool:
        """Whether it yields to a body."""
        able, v = self.ability, max(snapshot.ego.v, 0.1)
        ahead = -met.length < met.gap <= able.sight_m
        near = met.on_road and ahead and met.beside < able.room_m
        if not (near or met.conflict) or (able.forgives and name in self._yielded):
            return False
        time, outward = max(0.0, met.gap) / v, met.beside > 0.0 and met.inward < -0.1
        if outward:
            self._left[name] = snapshot.time
        if time > min(able.horizon_s, able.latest_ttc_s):
            return False
        if abs(met.inward) < 0.1 and abs(met.onward) < 0.1 and met.beside > 0.0:
            self._stood[name] = snapshot.time
        if snapshot.time - self._stood.get(name, -math.inf) < able.trusts_standing_s:
            return False
        if able.trusts_oncoming and met.onward < -0.2:
            return False
        if snapshot.time - self._left.get(name, -math.inf) < able.trusts_leaving_s:
            return False
        if able.stops_at_lane and met.beside > 0.0:
            return False
        if not able.gambles_s or met.inward <= 0.0:
            return True
        passes = (max(0.0, met.gap) + met.length) / v
        return met.beside / met.inward < passes - able.gambles_s


def _bearing(ego: BodyState, body: BodyState) -> float:
    """The direction from the ego to a body [rad]."""
    return math.atan2(body.y - ego.y, body.x - ego.x)


def _near(body: BodyState, others: list[BodyState], distance: float) -> bool:
    """Whether a body is so near to one of the others."""
    return any(math.dist((body.x, body.y), (b.x, b.y)) < distance for b in others)


class Careful(Driver):
    """Without a fault."""


FAULTS = {
    # perception
    "ShortSighted": Ability(sight_m=7.0),
    "NarrowView": Ability(half_view_rad=math.radians(8.0)),
    "LooksRarely": Ability(every_s=2.0),
    "SeesThePast": Ability(lag_s=1.8),
    "MissesTheSlow": Ability(slowest_mps=0.6),
    "SeesPoints": Ability(shrinks=True, room_m=0.0),
    "SeesTheNearestOnly": Ability(nearest_only=True, testers=2),
    "IgnoresOcclusion": Ability(hidden_rad=0.15, recognises_s=1.5, testers=2),
    "TakesGroupsForOne": Ability(groups_m=8.0, testers=2),
    "BlindToTheLeft": Ability(blind_left=True),
    "MisjudgesTheSide": Ability(aside_m=1.3),
    # prediction
    "LooksHalfASecondAhead": Ability(horizon_s=0.5),
    "TrustsTheStanding": Ability(trusts_standing_s=2.5),
    "TrustsTheOncoming": Ability(trusts_oncoming=True),
    "TrustsTheLeaving": Ability(trusts_leaving_s=3.0),
    "ExpectsAllToWait": Ability(stops_at_lane=True),
    # decision
    "ReactsLate": Ability(delay_s=2.0),
    "BrakesLate": Ability(latest_ttc_s=0.7),
    "Gambles": Ability(gambles_s=1.6),
    "ForgivesOnce": Ability(forgives=True),
    "LooksRarelyAndForgets": Ability(every_s=0.8, trusts_leaving_s=1.5),
    # action
    "WeakBrakes": Ability(decel=1.8),
    "SlowBrakes": Ability(jerk=1.0),
    "LetsGo": Ability(lets_go_s=0.6),
    "Creeps": Ability(creeps_mps=1.5),
}

CAREFUL = "Careful"
TESTERS = {name: ability.testers for name, ability in FAULTS.items()}

for _name, _ability in FAULTS.items():
    globals()[_name] = type(_name, (Driver,), {"ability": _ability, "__module__": __name__})
