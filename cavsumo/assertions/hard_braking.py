"""The ego does not brake hard, or not without need (Highway Code, rules 117 and 118)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar

from cavsumo.assertions.base import ASSERTIONS
from cavsumo.assertions.margin import Margin, MarginAssertion, acceleration
from cavsumo.assertions.metrics.highway_code import DECEL, THINKING_S
from cavsumo.assertions.reasons import has_reason
from cavsumo.model.checks import number, truth
from cavsumo.model.snapshot import Snapshot

ROOM_M = 5.0  # a body this far beyond the stopping distance is still a reason to brake


@ASSERTIONS.register("hard-braking")
class HardBrakingAssertion(MarginAssertion):
    """The ego does not brake hard without need (Highway Code, rules 117 and 118).

    Precondition: none. Violated by a deceleration above ``most``, unless a body in its way or
    coming there, a vehicle that moves or a red or amber light is within its stopping distance (rule
    126) and 5 m (``reasons``), now or when it began; with ``at_all`` for any reason. The default is
    a convention: telematics count events from 0.4 g. Robustness: ``most`` less the hardest
    deceleration that counts [m/s2]. Bodies: testers and background.
    """

    name: ClassVar[str] = "hard-braking"
    unit: ClassVar[str] = "m/s2"
    unconditional = True
    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "most": "deceleration that is not hard yet [m/s2]",
        "at_all": "whether no reason counts",
    }

    def __init__(self, most: float = 4.0, at_all: bool = False) -> None:
        self.most = number("most", most, 0.0, 100.0)
        self.at_all = truth("at_all", at_all)
        self.sees_background = not self.at_all

    def margins(self, snapshot: Snapshot, before: Snapshot | None) -> Iterator[Margin]:
        margin = self.most - max(0.0, -acceleration(snapshot, before))
        if margin >= -1e-9 or self.at_all:
            yield "", max(0.0, margin) if abs(margin) < 1e-9 else margin
        elif before is not None and not self._needed(before) and not self._needed(snapshot):
            yield "", margin

    def _needed(self, snapshot: Snapshot) -> bool:
        """Whether there was a reason to brake."""
        v = snapshot.ego.v
        stopping = THINKING_S * v + v * v / (2.0 * DECEL)
        return has_reason(self.scene, snapshot, stopping + ROOM_M)
