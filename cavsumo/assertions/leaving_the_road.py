"""The ego stays on the carriageway (Highway Code, rule 145)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar

from cavsumo.assertions.base import ASSERTIONS
from cavsumo.assertions.margin import Margin, MarginAssertion
from cavsumo.model.checks import number
from cavsumo.model.geometry import corners
from cavsumo.model.snapshot import Snapshot

END_M = 5.0  # the end of a road is no kerb: corners nearer to the ends of the path are ignored


@ASSERTIONS.register("leaving-the-road")
class LeavingTheRoadAssertion(MarginAssertion):
    """The ego stays on the carriageway with all corners of its box (Highway Code, rule 145).

    Precondition: none. Violated by a corner that is farther off the lanes for cars and the
    junctions between them than ``tolerance_m``; SUMO's vehicles cut corners by some decimetres.
    Robustness: distance of the corners from the edge, positive on the carriageway, plus the
    tolerance [m]. Uses the ego only.
    """

    name: ClassVar[str] = "leaving-the-road"
    unit: ClassVar[str] = "m"
    sees_background = False
    unconditional = True
    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "tolerance_m": "how far off the carriageway a corner may be [m]"
    }

    def __init__(self, tolerance_m: float = 0.5) -> None:
        self.tolerance_m = number("tolerance_m", tolerance_m, 0.0, 10.0)

    def margins(self, snapshot: Snapshot, before: Snapshot | None) -> Iterator[Margin]:
        roads, path = self.scene.roads, self.scene.ego_path
        if roads is None:
            return
        for x, y in corners(snapshot.ego.box):
            along = path.project(x, y).along
            if END_M < along < path.length - END_M:
                away = roads.edge_distance(x, y)
                yield "", (away if roads.contains(x, y) else -away) + self.tolerance_m
