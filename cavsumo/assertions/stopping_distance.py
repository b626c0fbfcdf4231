"""The ego keeps its overall stopping distance to bodies in its way (Highway Code, rule 126)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar

from cavsumo.assertions.base import ASSERTIONS
from cavsumo.assertions.contacts import STANDING_MPS
from cavsumo.assertions.margin import Margin, MarginAssertion, acceleration
from cavsumo.assertions.metrics.highway_code import DECEL, THINKING_S, WET
from cavsumo.assertions.relations import in_way
from cavsumo.model.checks import number, truth
from cavsumo.model.snapshot import Snapshot

NEARBY = 2.0  # stopping distances within which a body counts as ahead


@ASSERTIONS.register("stopping-distance")
class StoppingDistanceAssertion(MarginAssertion):
    """The ego keeps its stopping distance to bodies in its way (Highway Code, rule 126).

    "Never get closer than the overall stopping distance": thinking and braking distance by the
    model of the rule's table (``metrics.highway_code``), doubled on wet roads (rule 227).

    Precondition: a body is in the moving ego's way, within twice that distance. Violated by a gap
        that is shorter for longer than ``grace_s`` while the ego does not brake by ``braking``: it
        has that time to react to a body that steps or cuts in, and braking is a reaction.
    Robustness: the gap less the stopping distance [m], 0 at least while it brakes. Bodies: testers
    and background.
    """

    name: ClassVar[str] = "stopping-distance"
    unit: ClassVar[str] = "m"
    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "wet": "whether the road is wet, which doubles the distances",
        "grace_s": "how long the gap may be too short; the thinking time of rule 126 [s]",
        "braking": "deceleration by which the ego shows that it has reacted [m/s2]",
    }

    def __init__(
        self, wet: bool = False, grace_s: float = round(THINKING_S, 3), braking: float = 1.0
    ) -> None:
        self.factor = WET if truth("wet", wet) else 1.0
        self.grace_s = number("grace_s", grace_s, 0.0, 60.0)
        self.braking = number("braking", braking, 0.0, 100.0)

    def margins(self, snapshot: Snapshot, before: Snapshot | None) -> Iterator[Margin]:
        v = snapshot.ego.v
        if v <= STANDING_MPS:
            return
        needed = self.factor * (THINKING_S * v + v * v / (2.0 * DECEL))
        reacts = -acceleration(snapshot, before) >= self.braking - 1e-6
        for other in in_way(self.scene, snapshot, NEARBY * needed):
            margin = max(0.0, other.ahead) - needed
            yield other.body.id, max(0.0, margin) if reacts else margin
