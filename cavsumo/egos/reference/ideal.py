"""The ideal driver: brakes as hard as the ego can, at once."""

from __future__ import annotations

from collections.abc import Sequence

from cavsumo.egos.reference.base import REFERENCES, Reference
from cavsumo.egos.reference.encounter import Encounter, lasting_conflict
from cavsumo.model.bodies import Kind


@REFERENCES.register("ideal")
class IdealDriver(Reference):
    """Full braking of the ego's kind in the timestep in which a lasting conflict begins.

    No braking does better; what this driver cannot avoid, only steering or foresight could.
    """

    words = "an ideal driver (full braking at once)"

    def perceived(self, encounters: Sequence[Encounter | None], dt: float) -> int | None:
        return lasting_conflict(encounters, dt)

    def speed_lost(self, elapsed: float, kind: Kind) -> float:
        return -kind.throttle_min * elapsed
