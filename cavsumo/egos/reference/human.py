"""The careful and competent human driver of UN Regulation No. 157 (automated lane keeping).

Source: Annex 4, appendix 3 (guidance on traffic disturbance critical scenarios), table 1,
"performance model factors for vehicles": risk evaluation time 0.4 s; from the end of the perception
to the start of the deceleration 0.75 s; 0.6 s to the full deceleration of 0.774 g. See
docs/avoidable.md for what the regulation leaves open: it knows no pedestrians.
"""

from __future__ import annotations

from collections.abc import Sequence

from cavsumo.egos.reference.base import REFERENCES, Reference, ramped
from cavsumo.egos.reference.encounter import EVALUATION_S, Encounter, lasting_conflict
from cavsumo.model.bodies import Kind

DELAY_S = 0.75
RISE_S = 0.6
G_MPS2 = 9.80665
FULL_MPS2 = 0.774 * G_MPS2


@REFERENCES.register("human")
class HumanDriver(Reference):
    """Careful and competent human driver (UN R157): 1.15 s to react, then 0.774 g within 0.6 s."""

    words = "a careful human driver (UN R157)"

    def perceived(self, encounters: Sequence[Encounter | None], dt: float) -> int | None:
        return lasting_conflict(encounters, dt)

    def speed_lost(self, elapsed: float, kind: Kind) -> float:
        full = min(FULL_MPS2, -kind.throttle_min)
        return ramped(elapsed, EVALUATION_S + DELAY_S, RISE_S, full)
