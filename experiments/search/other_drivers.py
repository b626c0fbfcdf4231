"""Drivers that were not at hand when the searchers were made: another careful one, and its faults.

``Cautious`` is built otherwise than the driver of ``faulty_drivers``: it brakes as hard as it can
for everybody on the road who is near its way or whose course meets its own, and knows nothing in
between. Each of ``TESTERS`` has one fault that none of those drivers has. They were written
down once and played once; no searcher and no driver was changed after that.
"""

from __future__ import annotations

import math
from types import SimpleNamespace

from cavsumo.egos import Acceleration
from cavsumo.egos.reference.encounter import Encounter, encounter
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

SPEED_MPS, ACCEL_MPS2, HARDEST_MPS2 = 8.0, 2.0, 9.0
ROOM_M, STOP_M, SLOW_MPS = 1.2, 1.5, 0.3


class Cautious:
    """Without a fault."""

    depart_speed = SPEED_MPS

    def reset(self, scene: Scene) -> None:
        """Begin an episode."""
        self.scene = scene
        self.seen: dict[str, SimpleNamespace] = {}
        self.since = -math.inf  # when it last began to brake [s]
        self.brakes = False

    def act(self, snapshot: Snapshot) -> Acceleration:
        """The acceleration now."""
        v, dt = snapshot.ego.v, self.scene.dt
        risky = self.chosen([m for m in self._met(snapshot) if self.heeds(snapshot, *m)])
        asked = [a for _, met in risky if (a := self.asked(v, met)) > 0.0]
        if asked and not self.brakes:
            self.since = snapshot.time
        self.brakes = bool(asked)
        if asked and (hard := self.braking(snapshot, max(asked))) > 0.0:
            return Acceleration(-min(hard, v / dt))
        if risky and not asked:
            return Acceleration(min(0.0, (SPEED_MPS - v) / dt))  # keeps its speed
        return Acceleration(min(ACCEL_MPS2, (SPEED_MPS - v) / dt))

    def _met(self, snapshot: Snapshot) -> list[tuple[BodyState, Encounter]]:
        """The bodies, where it believes them."""
        found = []
        for body in (*snapshot.testers, *snapshot.background):
            known = self.seen.setdefault(body.id, SimpleNamespace(first=body, last=body))
            believed = self.believed(snapshot, body, known)
            known.last = body
            found.append((believed, encounter(self.scene, snapshot, believed)))
        return found

    def believed(self, snapshot: Snapshot, body: BodyState, known: SimpleNamespace) -> BodyState:
        """A body as it perceives it; ``known``: what it keeps in mind of it."""
        return body

    def heeds(self, snapshot: Snapshot, body: BodyState, met: Encounter) -> bool:
        """Whether it brakes for a body."""
        ahead = -met.length < met.gap < 60.0
        return ahead and met.on_road and (met.beside < ROOM_M or met.conflict)

    def chosen(self, risky: list[tuple[BodyState, Encounter]]) -> list[tuple[BodyState, Encounter]]:
        """Those of the bodies that it heeds for which it brakes."""
        return risky

    def asked(self, v: float, met: Encounter) -> float:
        """The deceleration that a body asks for [m/s2]: none while it is far, else all."""
        room = met.gap - STOP_M
        if room <= 0.0:
            return HARDEST_MPS2
        return HARDEST_MPS2 if v * v / (2.0 * room) > 2.5 else 0.0

    def braking(self, snapshot: Snapshot, wanted: float) -> float:
        """The deceleration that comes of one that it wants [m/s2]."""
        return wanted


class Smooths(Cautious):
    """Its velocities of others lag behind: a mean over the last 1.5 s or so."""

    def believed(self, snapshot: Snapshot, body: BodyState, known: SimpleNamespace) -> BodyState:
        speed = getattr(known, "speed", 0.0)
        known.speed = speed + (body.v - speed) * self.scene.dt / 1.5
        return body._replace(v=known.speed)

    def heeds(self, snapshot: Snapshot, body: BodyState, met: Encounter) -> bool:
        ahead = -met.length < met.gap < 60.0
        return ahead and met.on_road and (met.beside < 0.0 or met.conflict)


class LosesTracks(Cautious):
    """Loses everybody for 1.2 s of every 3 s."""

    def heeds(self, snapshot: Snapshot, body: BodyState, met: Encounter) -> bool:
        return snapshot.time % 3.0 < 1.8 and super().heeds(snapshot, body, met)


class ForgetsStanders(Cautious):
    """Takes who has stood for 1.5 s for a part of the street, until 1.5 s after they walk."""

    def believed(self, snapshot: Snapshot, body: BodyState, known: SimpleNamespace) -> BodyState:
        if body.v > SLOW_MPS:
            known.moved = snapshot.time
        stood = snapshot.time - getattr(known, "moved", snapshot.time)
        if stood > 1.5:
            known.forgotten = snapshot.time
        return body

    def heeds(self, snapshot: Snapshot, body: BodyState, met: Encounter) -> bool:
        forgotten = getattr(self.seen[body.id], "forgotten", -math.inf)
        return snapshot.time - forgotten > 1.5 and super().heeds(snapshot, body, met)


class SetsOffBlindly(Cautious):
    """Looks no farther than 2 m ahead below 3 m/s."""

    def heeds(self, snapshot: Snapshot, body: BodyState, met: Encounter) -> bool:
        return super().heeds(snapshot, body, met) and (met.speed > 3.0 or met.gap < 2.0)


class PumpsItsBrakes(Cautious):
    """Brakes for 0.4 s and lets go for 0.4 s, in turn."""

    def braking(self, snapshot: Snapshot, wanted: float) -> float:
        return wanted if (snapshot.time - self.since) % 0.8 < 0.4 else 0.0


class KnowsTheFirstCourse(Cautious):
    """Believes that everybody goes on as they first went on the road."""

    def believed(self, snapshot: Snapshot, body: BodyState, known: SimpleNamespace) -> BodyState:
        if not hasattr(known, "course") and encounter(self.scene, snapshot, body).on_road:
            known.course = body.v, body.o
        v, o = getattr(known, "course", (body.v, body.o))
        return body._replace(v=v, o=o)

    def heeds(self, snapshot: Snapshot, body: BodyState, met: Encounter) -> bool:
        return met.gap < 60.0 and met.conflict


class OverestimatesGaps(Cautious):
    """Takes gaps for twice as long as they are, and 2 m more."""

    def asked(self, v: float, met: Encounter) -> float:
        return super().asked(v, met._replace(gap=2.0 * met.gap + 2.0))


class YieldsToOne(Cautious):
    """Yields to whoever came first, and to nobody else until that one is gone."""

    def chosen(self, risky: list[tuple[BodyState, Encounter]]) -> list[tuple[BodyState, Encounter]]:
        first = getattr(self, "first", None)
        kept = [one for one in risky if one[0].id == first] or risky[:1]
        self.first = kept[0][0].id if kept else None
        return kept


class InsistsOnGoing(Cautious):
    """Having gone on after somebody, it goes on for 2 s."""

    def heeds(self, snapshot: Snapshot, body: BodyState, met: Encounter) -> bool:
        heeded = super().heeds(snapshot, body, met)
        if self.brakes and not heeded and self.seen[body.id].__dict__.get("heeded"):
            self.until = snapshot.time + 2.0
        self.seen[body.id].heeded = heeded
        return heeded and snapshot.time >= getattr(self, "until", -math.inf)


class SeesWhoWalksFast(Cautious):
    """Sees who is slower than 0.9 m/s only once it is in its lane for a second."""

    def heeds(self, snapshot: Snapshot, body: BodyState, met: Encounter) -> bool:
        known = self.seen[body.id]
        if met.beside >= 0.0:
            known.entered = math.inf
        elif getattr(known, "entered", math.inf) == math.inf:
            known.entered = snapshot.time
        quick = body.v > 0.9 or snapshot.time - known.entered >= 1.0
        return quick and super().heeds(snapshot, body, met)


class ExpectsPedestriansOnTheRight(Cautious):
    """Does not heed who comes across the other lane, until in its own."""

    def heeds(self, snapshot: Snapshot, body: BodyState, met: Encounter) -> bool:
        left = self.scene.ego_path.project(body.x, body.y).lateral > 0.0
        return super().heeds(snapshot, body, met) and (met.beside < 0.0 or not left)


class FadingBrakes(Cautious):
    """Its brakes lose half of their force in 0.5 s."""

    def braking(self, snapshot: Snapshot, wanted: float) -> float:
        return wanted * 0.5 ** ((snapshot.time - self.since) / 0.5)


CAREFUL = "Cautious"
# Each faulty driver, and by how many pedestrians it can be failed.
TESTERS = {
    "Smooths": 1,
    "LosesTracks": 1,
    "ForgetsStanders": 1,
    "SetsOffBlindly": 1,
    "PumpsItsBrakes": 1,
    "KnowsTheFirstCourse": 1,
    "OverestimatesGaps": 1,
    "YieldsToOne": 2,
    "InsistsOnGoing": 1,
    "SeesWhoWalksFast": 1,
    "ExpectsPedestriansOnTheRight": 1,
    "FadingBrakes": 1,
}
