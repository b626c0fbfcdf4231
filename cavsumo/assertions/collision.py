"""The assertion that the moving ego touches no body, independently of fault."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

from cavsumo.assertions.base import ASSERTIONS, HELD, VIOLATED, Assertion, Judgement
from cavsumo.assertions.clearance import Room, impact
from cavsumo.assertions.contacts import STANDING_MPS, Contact
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot


@ASSERTIONS.register("collision")
class CollisionAssertion(Assertion):
    """The moving ego touches no body at all. Precondition: none, every episode is a test.

    A body that touches the standing ego walked into it and violates nothing; in a scripted test
    that ends the case, because a programme goes on through the ego. Robustness: smallest gap of the
    moving ego to a tester [m]; of a contact minus the closing speed [m/s].
    """

    name: ClassVar[str] = "collision"
    unit: ClassVar[str] = "m, minus m/s"
    sees_background = False
    unconditional = True

    def reset(self, scene: Scene) -> None:
        super().reset(scene)
        self.judgement = Judgement(self.name, HELD, trigger_time=0.0)
        self._room = Room()

    def observe(self, snapshot: Snapshot, contacts: Sequence[Contact]) -> None:
        if snapshot.ego.v <= STANDING_MPS and self.scene.script is not None:
            self.decided |= any(contact.a is snapshot.ego for contact in contacts)
        if self.decided or snapshot.ego.v <= STANDING_MPS:
            return
        if any([self._room.note(snapshot.ego, tester) for tester in snapshot.testers]):
            self.judgement = replace(self.judgement, robustness=self._room.smallest)
        for contact in contacts:
            if contact.a is snapshot.ego and not self.decided:
                self.decided = True
                self.judgement = Judgement(
                    self.name,
                    VIOLATED,
                    contact.b.id,
                    trigger_time=0.0,
                    violation_time=contact.time,
                    ego_speed=snapshot.ego.v,
                    impact_speed=contact.closing_speed,
                    robustness=impact(contact),
                )
