"""The driver with the proper response of Responsibility-Sensitive Safety, and no more.

Source: Shalev-Shwartz et al., arXiv 1708.06374, definitions 1, 2 and 6 (safe distances), 3 and 7
(dangerous when neither the longitudinal nor the lateral distance is safe) and the proper response:
within the response time the vehicle may go on, after it it brakes with at least b_min.
"""

from __future__ import annotations

from collections.abc import Sequence

from cavsumo.assertions.metrics.rss import rss_lateral, rss_longitudinal, rss_longitudinal_opposite
from cavsumo.egos.reference.base import REFERENCES, Reference, ramped
from cavsumo.egos.reference.encounter import SIGHT_M, Encounter
from cavsumo.model.bodies import Kind

# The values that ad-rss-lib's users take as defaults (Apollo's RSS decider writes them out).
RESPONSE_S = 1.0
ACCEL_MAX, BRAKE_MAX, BRAKE_MIN, BRAKE_MIN_CORRECT = 3.5, 8.0, 4.0, 3.0  # m/s2
LATERAL_ACCEL_MAX, LATERAL_BRAKE_MIN = 0.2, 0.8  # m/s2
LATERAL_MARGIN_M = 0.0  # for fluctuations, of which there are none here


@REFERENCES.register("rss")
class RssDriver(Reference):
    """Proper response of RSS: from a dangerous situation on, 1 s as before, then 4 m/s2."""

    words = "a driver with RSS's proper response"

    def perceived(self, encounters: Sequence[Encounter | None], dt: float) -> int | None:
        since = None
        for step, met in enumerate(encounters):
            if met is None or not dangerous(met):
                since = None
            elif since is None:
                since = step
        return since

    def speed_lost(self, elapsed: float, kind: Kind) -> float:
        return ramped(elapsed, RESPONSE_S, 0.0, min(BRAKE_MIN, -kind.throttle_min))


def dangerous(met: Encounter) -> bool:
    """Whether neither distance is safe. A body behind the ego must keep the distance itself."""
    if met.gap <= -met.length or met.gap > SIGHT_M:
        return False
    beside = rss_lateral(
        met.inward, 0.0, RESPONSE_S, LATERAL_ACCEL_MAX, LATERAL_BRAKE_MIN, LATERAL_MARGIN_M
    )
    return met.gap < _safe_gap(met) and met.beside < float(beside)


def _safe_gap(met: Encounter) -> float:
    """The safe longitudinal distance to a body ahead, or to an oncoming one [m]."""
    if met.onward >= 0.0:
        return float(
            rss_longitudinal(met.speed, met.onward, RESPONSE_S, ACCEL_MAX, BRAKE_MIN, BRAKE_MAX)
        )
    return float(
        rss_longitudinal_opposite(
            met.speed, met.onward, RESPONSE_S, ACCEL_MAX, BRAKE_MIN_CORRECT, BRAKE_MIN
        )
    )
