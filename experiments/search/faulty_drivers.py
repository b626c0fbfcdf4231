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
    through_others: bool = True  # sees bodies behind others
    blind_left: bool = False
    # prediction
    horizon_s: float = math.inf
    room_m: float = ROOM_M
    trusts_standing_s: float = 0.0  # who stood within that time still stands
    trusts_oncoming: bool = False  # those who come towards it go past
    trusts_leaving_s: float = 0.0  # who has left its way does not come back for so long
    stops_at_lane: bool = False  # whoever is not in its way yet will wait
    # decision
    delay_s: float = 0.0
    latest_ttc_s: float = math.inf
    gambles: bool = False  # passes before somebody where it reckons that it can
    forgives: bool = False  # yields to each body once
    # action
    decel: float = HARDEST_MPS2
    jerk: float = math.inf
    lets_go_s: float = math.inf  # brakes no longer than this
    creeps_mps: float = 0.0


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
        if not able.through_others:
            bodies = [b for i, b in enumerate(bodies) if not _hidden(ego, b, bodies[:i])]
        return bodies[:1] if able.nearest_only else bodies

    def _notices(self, ego: BodyState, body: BodyState) -> bool:
        """Whether it notices a body."""
        able = self.ability
        dx, dy = body.x - ego.x, body.y - ego.y
        bearing = math.remainder(math.atan2(dy, dx) - ego.o, math.tau)
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
        if abs(met.inward) < 0.1 and abs(met.onward) < 0.1:
            self._stood[name] = snapshot.time
        since = snapshot.time - self._stood.get(name, -math.inf)
        if since < able.trusts_standing_s and met.beside > 0.0:
            return False
        if able.trusts_oncoming and met.beside > 0.0 and met.onward < -0.2:
            return False
        since = snapshot.time - self._left.get(name, -math.inf)
        if since < able.trusts_leaving_s and met.beside > 0.0:
            return False
        if able.stops_at_lane and met.beside > 0.0:
            return False
        passes = (max(0.0, met.gap) + met.length) / v
        return not (able.gambles and met.inward > 0.0 and met.beside / met.inward > passes - 0.6)


def _hidden(ego: BodyState, body: BodyState, nearer: list[BodyState]) -> bool:
    """Whether a nearer body hides one from the ego's centre."""
    angle = math.atan2(body.y - ego.y, body.x - ego.x)
    for other in nearer:
        far = math.dist((other.x, other.y), (ego.x, ego.y))
        width = math.atan2(other.body.kind.reach, far)
        there = math.atan2(other.y - ego.y, other.x - ego.x)
        if abs(math.remainder(angle - there, math.tau)) < width:
            return True
    return False


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
    "SeesTheNearestOnly": Ability(nearest_only=True),
    "IgnoresOcclusion": Ability(through_others=False),
    "BlindToTheLeft": Ability(blind_left=True),
    # prediction
    "LooksOneSecondAhead": Ability(horizon_s=0.8, room_m=0.0),
    "TrustsTheStanding": Ability(trusts_standing_s=2.5),
    "TrustsTheOncoming": Ability(trusts_oncoming=True),
    "TrustsTheLeaving": Ability(trusts_leaving_s=3.0),
    "ExpectsAllToWait": Ability(stops_at_lane=True),
    "NoMargin": Ability(room_m=-0.4),
    # decision
    "ReactsLate": Ability(delay_s=2.0),
    "BrakesLate": Ability(latest_ttc_s=0.7),
    "Gambles": Ability(gambles=True),
    "ForgivesOnce": Ability(forgives=True),
    "LooksRarelyAndForgets": Ability(every_s=0.8, trusts_leaving_s=1.5),
    # action
    "WeakBrakes": Ability(decel=1.8),
    "SlowBrakes": Ability(jerk=2.0),
    "LetsGo": Ability(lets_go_s=0.6),
    "Creeps": Ability(creeps_mps=1.5),
}

for _name, _ability in FAULTS.items():
    globals()[_name] = type(_name, (Driver,), {"ability": _ability, "__module__": __name__})
