"""The bluntest assertion: the moving ego touches nobody, whosever fault it is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from cavsumo.assertions.base import ASSERTIONS, HELD, VIOLATED, Assertion, Judgement
from cavsumo.contacts import STANDING_MPS, Contact
from cavsumo.scene import Scene
from cavsumo.snapshot import Snapshot


@ASSERTIONS.register("collision")
class CollisionAssertion(Assertion):
    """The moving ego touches no body at all. Precondition: none, every episode is a test.

    A body that touches the standing ego walked into it and violates nothing.
    """

    name: ClassVar[str] = "collision"
    sees_background = False

    def reset(self, scene: Scene) -> None:
        super().reset(scene)
        self.judgement = Judgement(self.name, HELD, trigger_time=0.0)

    def observe(self, snapshot: Snapshot, contacts: Sequence[Contact]) -> None:
        for contact in contacts:
            if contact.a is snapshot.ego and snapshot.ego.v > STANDING_MPS and not self.decided:
                self.decided = True
                self.judgement = Judgement(
                    self.name,
                    VIOLATED,
                    contact.b.id,
                    trigger_time=0.0,
                    violation_time=contact.time,
                    ego_speed=snapshot.ego.v,
                    impact_speed=contact.closing_speed,
                )
