"""The ego gives way to pedestrians at zebra crossings (Highway Code, rules H2 and 195)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import ClassVar

import shapely
from shapely.geometry import Point, Polygon

from cavsumo.assertions.base import ASSERTIONS
from cavsumo.assertions.margin import Margin, MarginAssertion
from cavsumo.assertions.metrics.highway_code import DECEL, THINKING_S
from cavsumo.assertions.relations import everybody, front_along
from cavsumo.model.bodies import WALKING
from cavsumo.model.carriageway import MarkedCrossing
from cavsumo.model.checks import number, truth
from cavsumo.model.geometry import corners
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

AHEAD_M = 60.0  # distance from which a crossing counts
CLEAR_M = 0.5  # a pedestrian this far beside the ego's strip that walks away has crossed
FACING = math.cos(math.pi / 3)  # a waiting pedestrian faces the crossing within 60 degrees


@ASSERTIONS.register("give-way")
class GiveWayAssertion(MarginAssertion):
    """The ego gives way to pedestrians at zebra crossings (Highway Code, rules H2 and 195).

    Precondition: a pedestrian comes onto a marked crossing on the ego's path, or waits at its kerb,
    facing it, while the ego can still stop before it (overall stopping distance, rule 126).
    Violated when the front bumper passes the crossing's edge while that pedestrian is in the ego's
    way, on the way there or waiting. Robustness: smallest distance of the bumper to the crossing
    while way is owed, negative past its edge [m]. Bodies: pedestrians among testers and
    background.
    """

    name: ClassVar[str] = "give-way"
    unit: ClassVar[str] = "m"
    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "kerb_m": "how near the crossing someone waits; 0 counts only who is on it [m]",
        "every": "at every crossing without lights, not only where the network gives pedestrians "
        "priority",
    }

    def __init__(self, kerb_m: float = 1.0, every: bool = False) -> None:
        self.kerb_m = number("kerb_m", kerb_m, 0.0, 20.0)
        self.every = truth("every", every)

    def reset(self, scene: Scene) -> None:
        super().reset(scene)
        self._crossings = [
            c for c in scene.crossings if not c.signalled and (c.priority or self.every)
        ]
        self._owed: dict[tuple[str, str], bool] = {}  # crossing and pedestrian
        self._entered: set[str] = set()
        for crossing in self._crossings:
            shapely.prepare(crossing.surface)

    def margins(self, snapshot: Snapshot, before: Snapshot | None) -> Iterator[Margin]:
        front = front_along(self.scene, snapshot)
        for crossing in self._crossings:
            left = crossing.begin - front
            if crossing.id in self._entered or left > AHEAD_M:
                continue
            if left < 0.0:
                self._entered.add(crossing.id)
            for body in self._with_right(crossing, snapshot, left):
                yield body.id, left

    def _with_right(
        self, crossing: MarkedCrossing, snapshot: Snapshot, left: float
    ) -> Sequence[BodyState]:
        """The pedestrians to which the ego must give way: they came while it could still stop."""
        v = snapshot.ego.v
        can_stop = left >= THINKING_S * v + v * v / (2.0 * DECEL)
        there = [b for b in everybody(snapshot) if self._claims(crossing, snapshot, b)]
        now = {(crossing.id, body.id) for body in there}
        others = {key: owed for key, owed in self._owed.items() if key[0] != crossing.id}
        self._owed = others | {key: self._owed.get(key, can_stop) for key in now}
        return [body for body in there if self._owed[crossing.id, body.id]]

    def _claims(self, crossing: MarkedCrossing, snapshot: Snapshot, body: BodyState) -> bool:
        """Whether a pedestrian is on a crossing before the ego's way, or waits at its kerb."""
        if body.body.kind.name not in WALKING:
            return False
        x0, y0, x1, y1 = crossing.surface.bounds
        room = self.kerb_m + body.body.kind.reach
        if not (x0 - room <= body.x <= x1 + room and y0 - room <= body.y <= y1 + room):
            return False
        on = bool(crossing.surface.intersects(Polygon(corners(body.box))))
        return (on or self._waits(crossing, body)) and not self._has_crossed(body, snapshot)

    def _waits(self, crossing: MarkedCrossing, body: BodyState) -> bool:
        """Whether a pedestrian faces a crossing from within ``kerb_m``."""
        if shapely.distance(crossing.surface, Point(body.x, body.y)) > self.kerb_m:
            return False
        x, y = crossing.surface.centroid.coords[0]
        facing = math.cos(math.atan2(y - body.y, x - body.x) - body.o)
        return facing >= FACING

    def _has_crossed(self, body: BodyState, snapshot: Snapshot) -> bool:
        """Whether a pedestrian is beside the ego's strip and faces away from it."""
        here = self.scene.ego_path.project(body.x, body.y)
        o = self.scene.ego_path.at(here.along)[2]
        away = math.sin(body.o - o) * math.copysign(1.0, here.lateral) > 0.0
        half = snapshot.ego.body.kind.width / 2 + body.body.kind.length / 2
        return away and abs(here.lateral) > half + CLEAR_M
