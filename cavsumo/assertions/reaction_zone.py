"""The seed's key assertion: the ego hits no body that it could have avoided.

Source: CAV-Gym (stopping zones, "interesting" tests); the seed, Definition 2, where the goal of
the tester is the precondition of an assertion.

The precondition is that a tester's body enters the ego's reaction zone before it touches the
braking zone or the ego: late enough to be hard, early enough for a vehicle that brakes at once.
A body that touches the braking zone or the ego first makes the episode unfair.

Vehicles among the testers count by where they will be and only in the ego's way
(``zone_presence``): one that the ego follows at an ordinary distance is in no zone until it brakes,
and one beside it in its own lane never is. A vehicle that drives into the ego's side or rear after
the trigger makes the episode unfair: no ego could have avoided it.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

from cavsumo.assertions.base import (
    ASSERTIONS,
    HELD,
    UNFAIR,
    VIOLATED,
    Assertion,
    Judgement,
)
from cavsumo.assertions.clearance import Room, impact
from cavsumo.assertions.contacts import STANDING_MPS, Contact
from cavsumo.model.bodies import WALKING
from cavsumo.model.checks import number
from cavsumo.model.geometry import TOUCH, Box, in_frame, overlap
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.model.stopping_zones import zone_entered
from cavsumo.model.zone_presence import counted, drives_clear, is_vehicle, out_of_the_way, ran_into

BESIDE_M = 0.2  # a body this far beside the strip ahead has left the ego's way


@ASSERTIONS.register("reaction-zone")
class ReactionZoneAssertion(Assertion):
    """The ego hits no body it could have avoided (CAV-Gym's key assertion, the default).

    Decided by contact, by the ego having passed the body or standing clear of it, or by the body
    having left the ego's way; a body that comes back after that meets the ego anew. Robustness:
    smallest gap to the body since the trigger [m]; of a violation minus the closing speed [m/s].
    """

    name: ClassVar[str] = "reaction-zone"
    unit: ClassVar[str] = "m, minus m/s"
    sees_background = False
    about_testers = True
    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "max_decel": "the deceleration that the zones assume [m/s2]",
        "reaction_time": "the reaction time that the zones assume [s]",
        "clear_s": "how long the ego must stand clear, or a vehicle ahead drive clear, for the "
        "verdict held [s]",
    }

    def __init__(
        self, max_decel: float = 9.0, reaction_time: float = 0.675, clear_s: float = 1.0
    ) -> None:
        self.max_decel = number("max_decel", max_decel, 0.1, 100.0)
        self.reaction_time = number("reaction_time", reaction_time, 0.0, 10.0)
        self.clear_s = number("clear_s", clear_s, 0.0, 60.0)

    def reset(self, scene: Scene) -> None:
        super().reset(scene)
        self._body: int | None = None
        self._room = Room()
        self._standing_since: float | None = None
        self._clear_since: float | None = None
        vehicles = [body.kind.v_max for body in scene.bodies if body.kind.name not in WALKING]
        self._oncoming = max(vehicles, default=0.0)  # the fastest that one can come [m/s]

    def observe(self, snapshot: Snapshot, contacts: Sequence[Contact]) -> None:
        if self.decided:
            return
        if self._body is None:
            self._watch_zones(snapshot)
        else:
            self._watch_contact(snapshot, contacts, snapshot.testers[self._body])

    def _watch_zones(self, snapshot: Snapshot) -> None:
        """Look for the first zone that any body enters; at the same timestep unfair wins."""
        ego = snapshot.ego
        if ego.v <= STANDING_MPS:
            return
        far = self._far(ego)
        entered = [
            (self._zone(snapshot, tester), i)
            for i, tester in enumerate(snapshot.testers)
            # written out of _zone, which most bodies never get to
            if abs(tester.x - ego.x) <= far + tester.body.kind.reach
            and abs(tester.y - ego.y) <= far + tester.body.kind.reach
        ]
        if not entered:
            return
        early = [i for zone, i in entered if zone in ("body", "braking")]
        fair = [i for zone, i in entered if zone == "reaction"]
        if early:
            self._enter(snapshot, early[0], UNFAIR)
            self.decided = True
        elif fair:
            self._enter(snapshot, fair[0], HELD)
            self.pending, self._body = True, fair[0]
            self._room.note(snapshot.ego, snapshot.testers[fair[0]])
            room = self._room.smallest
            self.judgement = dataclasses.replace(self.judgement, robustness=room)

    def _far(self, ego: BodyState) -> float:
        """No zone, arcs included, leads farther from the ego's centre than this [m]."""
        braking = 0.5 * ego.v * ego.v / self.max_decel
        drift = self._oncoming * ego.v / self.max_decel
        return ego.body.kind.reach + braking + self.reaction_time * ego.v + drift

    def _zone(self, snapshot: Snapshot, tester: BodyState) -> str | None:
        """The zone that a body touches."""
        ego = snapshot.ego
        if is_vehicle(tester):
            return self._vehicle_zone(snapshot, tester)
        if not snapshot.ego_steering:  # the zones are no wider than the ego
            across = (tester.y - ego.y) * math.cos(ego.o) - (tester.x - ego.x) * math.sin(ego.o)
            if abs(across) > ego.body.kind.width / 2 + tester.body.kind.reach + TOUCH:
                return None
        return self._touched(snapshot, tester.box)

    def _vehicle_zone(self, snapshot: Snapshot, tester: BodyState) -> str | None:
        """The zone in which a vehicle counts; touching the ego it counts where it is."""
        ego = snapshot.ego
        if overlap(ego.box, tester.box):
            return "body"
        zone = self._touched(snapshot, counted(tester, ego, self.max_decel))
        if zone is None or out_of_the_way(tester, ego, self.scene.ego_path):
            return None
        return "braking" if zone == "body" else zone

    def _touched(self, snapshot: Snapshot, box: Box) -> str | None:
        """The zone that a box touches."""
        ego = snapshot.ego
        return zone_entered(
            box,
            ego.box,
            ego.v,
            max_decel=self.max_decel,
            reaction_time=self.reaction_time,
            steering=snapshot.ego_steering,
            wheelbase=ego.body.kind.wheelbase,
        )

    def _enter(self, snapshot: Snapshot, body: int, verdict: str) -> None:
        """Record who entered a zone, and when."""
        self.judgement = Judgement(
            self.name,
            verdict,
            snapshot.testers[body].id,
            trigger_time=snapshot.time if verdict == HELD else None,
            ego_speed=snapshot.ego.v,
        )

    def _watch_contact(
        self, snapshot: Snapshot, contacts: Sequence[Contact], body: BodyState
    ) -> None:
        """Wait for the contact, or until the ego has passed or stands clear."""
        ego = snapshot.ego
        hit = next((c for c in contacts if c.a is ego and c.b.id == body.id), None)
        if self._room.note(ego, body):
            room = self._room.smallest
            self.judgement = dataclasses.replace(self.judgement, robustness=room)
        if hit is not None and is_vehicle(body) and ran_into(body, ego, self.scene.dt):
            self.judgement = dataclasses.replace(
                self.judgement,
                verdict=UNFAIR,
                trigger_time=None,
                ego_speed=ego.v,
                robustness=None,
            )
            self._decide()
        elif hit is not None and ego.v > STANDING_MPS:
            self.judgement = dataclasses.replace(
                self.judgement,
                verdict=VIOLATED,
                violation_time=snapshot.time,
                ego_speed=ego.v,
                impact_speed=hit.closing_speed,
                robustness=impact(hit),
            )
            self._decide()
        elif (
            self._passed(ego, body)
            or self._left(snapshot, body)
            or self._stands_clear(snapshot)
            or (is_vehicle(body) and self._drives_clear(snapshot, body))
        ):
            self._decide()

    def _decide(self) -> None:
        self.decided, self.pending = True, False

    def _passed(self, ego: BodyState, body: BodyState) -> bool:
        """Whether the whole body lies behind the ego's rear bumper."""
        seen = in_frame(body.box, ego.x, ego.y, ego.o)
        return seen.x + body.body.kind.reach < -ego.body.kind.length / 2

    def _left(self, snapshot: Snapshot, body: BodyState) -> bool:
        """Whether the body is out of the zones, beside the strip ahead and beside the path."""
        ego = snapshot.ego
        ahead = in_frame(body.box, ego.x, ego.y, ego.o).y
        planned = self.scene.ego_path.project(body.x, body.y).lateral
        room = min(abs(ahead), abs(planned)) - body.body.kind.reach - ego.body.kind.width / 2
        return room > BESIDE_M and self._zone(snapshot, body) is None

    def _drives_clear(self, snapshot: Snapshot, body: BodyState) -> bool:
        """Whether a vehicle has been ahead of the zones and no slower than the ego long enough."""
        if not drives_clear(body, snapshot.ego) or self._zone(snapshot, body) is not None:
            self._clear_since = None
            return False
        if self._clear_since is None:
            self._clear_since = snapshot.time
        return snapshot.time - self._clear_since >= self.clear_s - 1e-9

    def _stands_clear(self, snapshot: Snapshot) -> bool:
        """Whether the ego has been standing for long enough."""
        if snapshot.ego.v > STANDING_MPS:
            self._standing_since = None
            return False
        if self._standing_since is None:
            self._standing_since = snapshot.time
        return snapshot.time - self._standing_since >= self.clear_s - 1e-9
