"""The ego does not stand without reason (Highway Code, rules 154 and 240).

An ego that never moves passes every other assertion; this one distinguishes it from a safe ego.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import ClassVar

from cavsumo.assertions.base import ASSERTIONS, VIOLATED
from cavsumo.assertions.contacts import STANDING_MPS, Contact
from cavsumo.assertions.margin import Margin, MarginAssertion
from cavsumo.assertions.reasons import has_reason
from cavsumo.model.checks import number
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot


@ASSERTIONS.register("standing")
class StandingAssertion(MarginAssertion):
    """The ego does not stand for long without reason; one that never moves is not safe.

    Precondition: it stands. Violated when it stands for longer than ``most_s`` with no body in its
    way or coming there, no vehicle moving and no red or amber light within ``near_m``
    (``reasons``). The rule it comes from: do not stop where you hinder others (Highway Code, rule
    240). Robustness: ``most_s`` less the longest such time [s]. Bodies: testers and background.
    """

    name: ClassVar[str] = "standing"
    unit: ClassVar[str] = "s"
    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "most_s": "how long the ego may stand without reason [s]",
        "near_m": "how near a reason must be [m]",
    }

    def __init__(self, most_s: float = 10.0, near_m: float = 30.0) -> None:
        self.most_s = number("most_s", most_s, 0.1, 3600.0)
        self.near_m = number("near_m", near_m, 1.0, 1000.0)

    def reset(self, scene: Scene) -> None:
        super().reset(scene)
        self._since: float | None = None

    def margins(self, snapshot: Snapshot, before: Snapshot | None) -> Iterator[Margin]:
        if snapshot.ego.v > STANDING_MPS:
            self._since = None
            return
        if self._since is None or has_reason(self.scene, snapshot, self.near_m):
            self._since = snapshot.time
        yield "", self.most_s - (snapshot.time - self._since)

    def observe(self, snapshot: Snapshot, contacts: Sequence[Contact]) -> None:
        super().observe(snapshot, contacts)
        if self.judgement.verdict == VIOLATED and not self.decided:
            self.decided = True  # it may stand for ever
        idle = self._since is not None and snapshot.time > self._since
        self.pending = idle and not self.decided
