"""The ego stops at red, and at amber if it can (Highway Code, rules 109 and 175)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar

from cavsumo.assertions.base import ASSERTIONS
from cavsumo.assertions.margin import Margin, MarginAssertion
from cavsumo.assertions.metrics.highway_code import DECEL, THINKING_S
from cavsumo.assertions.relations import front_along
from cavsumo.model.checks import number, truth
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

RED, AMBER = "ru", "yY"  # SUMO's letters; u is red and amber, which still means stop


@ASSERTIONS.register("red-light")
class RedLightAssertion(MarginAssertion):
    """The ego does not pass a stop line at red, nor at amber if it can stop (rules 109 and 175).

    Precondition: a light that the ego has within ``within_m`` ahead shows red or amber. Violated
    when the front bumper passes the stop line at red (before and after the timestep), or at an
    amber that came up while the line was farther than the overall stopping distance of rule 126:
    "you may go on only if the amber appears after you have crossed the stop line or are so close
    to it that to pull up might cause a collision". Robustness: smallest distance to the line while
    the light requires a stop, negative past it [m]. Uses the lights.
    """

    name: ClassVar[str] = "red-light"
    unit: ClassVar[str] = "m"
    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "within_m": "from how far before the line the light is looked at [m]",
        "amber": "whether an ego that can stop must stop at amber",
    }

    def __init__(self, within_m: float = 50.0, amber: bool = True) -> None:
        self.within_m = number("within_m", within_m, 1.0, 1000.0)
        self.amber = truth("amber", amber)

    def reset(self, scene: Scene) -> None:
        super().reset(scene)
        self._stops = [False] * len(scene.lights)  # whether each light requires the ego to stop
        self._passed = [False] * len(scene.lights)

    def margins(self, snapshot: Snapshot, before: Snapshot | None) -> Iterator[Margin]:
        front = front_along(self.scene, snapshot)
        for i, (light, shown) in enumerate(zip(self.scene.lights, snapshot.lights, strict=False)):
            if self._passed[i]:
                continue
            left = light.along - front
            stopped, self._stops[i] = self._stops[i], self._says_stop(i, shown, left, snapshot)
            if left < 0.0:
                self._passed[i] = True
                if before is not None and stopped and self._stops[i]:
                    yield "", left
            elif self._stops[i] and left <= self.within_m:
                yield "", left

    def _says_stop(self, i: int, shown: str, left: float, snapshot: Snapshot) -> bool:
        """Whether a light requires an ego at that distance before its line to stop."""
        if shown in RED:
            return True
        if shown not in AMBER or not self.amber:
            return False
        v = snapshot.ego.v
        # The requirement of an amber light when it appeared holds until it changes.
        return self._stops[i] or self._came_up(i, shown, left, v)

    def _came_up(self, i: int, shown: str, left: float, v: float) -> bool:
        """Whether an ego can stop at an amber that has just come up."""
        fresh = self._last is None or self._last.lights[i : i + 1] != (shown,)
        return fresh and left >= THINKING_S * v + v * v / (2.0 * DECEL)
