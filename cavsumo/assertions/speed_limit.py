"""The ego keeps to the speed limit (Highway Code, rule 124)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar

from cavsumo.assertions.base import ASSERTIONS
from cavsumo.assertions.margin import Margin, MarginAssertion
from cavsumo.assertions.metrics.highway_code import MPH
from cavsumo.model.checks import number
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot


@ASSERTIONS.register("speed-limit")
class SpeedLimitAssertion(MarginAssertion):
    """The ego keeps to the speed limits of its lanes (Highway Code, rule 124).

    Precondition: none. Violated by a speed above the network's limit where the ego's centre is,
    plus the tolerance; the default is the threshold of police enforcement in the UK (National
    Police Chiefs' Council: 10 % and 2 mph). Robustness: limit and tolerance less speed [m/s]. Uses
    the ego only.
    """

    name: ClassVar[str] = "speed-limit"
    unit: ClassVar[str] = "m/s"
    sees_background = False
    unconditional = True
    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "share": "tolerance as a share of the limit",
        "plus_mps": "tolerance besides that; 2 mph [m/s]",
    }

    def __init__(self, share: float = 0.1, plus_mps: float = round(2 * MPH, 3)) -> None:
        self.share = number("share", share, 0.0, 10.0)
        self.plus_mps = number("plus_mps", plus_mps, 0.0, 100.0)

    def reset(self, scene: Scene) -> None:
        super().reset(scene)
        self._next = 0

    def margins(self, snapshot: Snapshot, before: Snapshot | None) -> Iterator[Margin]:
        limits, along = self.scene.limits, self.scene.ego_progress(snapshot)
        while self._next < len(limits) and limits[self._next].along <= along:
            self._next += 1
        if self._next:
            limit = limits[self._next - 1].speed
            yield "", limit * (1.0 + self.share) + self.plus_mps - snapshot.ego.v
