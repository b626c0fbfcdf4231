"""The ego keeps two seconds to the vehicle ahead (Highway Code, rule 126)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar

from cavsumo.assertions.base import ASSERTIONS
from cavsumo.assertions.margin import Margin, MarginAssertion
from cavsumo.assertions.metrics.highway_code import MPH, WET
from cavsumo.assertions.relations import in_way
from cavsumo.model.checks import number, truth
from cavsumo.model.snapshot import Snapshot
from cavsumo.model.zone_presence import is_vehicle

ALONG = 0.7  # share of a vehicle's speed that is along the path when it drives the ego's way


@ASSERTIONS.register("two-second-gap")
class TwoSecondGapAssertion(MarginAssertion):
    """The ego keeps two seconds to the vehicle ahead, four when wet (Highway Code, rule 126).

    Precondition: a vehicle that drives the same way is in the way of an ego faster than
    ``from_mps``, within twice the gap. Violated by a time gap (distance over the ego's speed) that
    is shorter for longer than ``grace_s``, so that an ego can fall back after a vehicle cuts in.
    Robustness: the time gap less the one to keep [s]. Bodies: testers and background.
    """

    name: ClassVar[str] = "two-second-gap"
    unit: ClassVar[str] = "s"
    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "gap_s": "time gap to keep on dry roads [s]",
        "wet": "whether the road is wet, which doubles the gap",
        "grace_s": "how long the gap may be too short [s]",
        "from_mps": "speed of the ego from which the rule is asserted; 20 mph, the first row of "
        "the rule's table [m/s]",
    }

    def __init__(
        self,
        gap_s: float = 2.0,
        wet: bool = False,
        grace_s: float = 3.0,
        from_mps: float = round(20 * MPH, 3),
    ) -> None:
        self.gap_s = number("gap_s", gap_s, 0.1, 60.0) * (WET if truth("wet", wet) else 1.0)
        self.grace_s = number("grace_s", grace_s, 0.0, 60.0)
        self.from_mps = number("from_mps", from_mps, 0.1, 100.0)

    def margins(self, snapshot: Snapshot, before: Snapshot | None) -> Iterator[Margin]:
        v = snapshot.ego.v
        if v < self.from_mps:
            return
        for other in in_way(self.scene, snapshot, 2.0 * self.gap_s * v):
            body = other.body
            if is_vehicle(body) and other.onward > ALONG * body.v:
                yield body.id, max(0.0, other.ahead) / v - self.gap_s
