"""Responsibility-Sensitive Safety: in a dangerous situation the ego responds properly.

Source: Shalev-Shwartz, Shammah and Shashua, arXiv 1708.06374 (definitions 1, 2, 6 and the proper
response). Distances and speeds are taken along and across the ego's path.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

from cavsumo.assertions.base import ASSERTIONS
from cavsumo.assertions.contacts import STANDING_MPS
from cavsumo.assertions.margin import Margin, MarginAssertion, acceleration
from cavsumo.assertions.metrics.rss import rss_lateral, rss_longitudinal, rss_longitudinal_opposite
from cavsumo.assertions.relations import Relation, relations
from cavsumo.model.checks import number
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

RANGE_M = 150.0  # bodies farther away are ignored
SLACK = 0.05  # m/s2, tolerance for rounding


@dataclass(frozen=True)
class Danger:
    """A dangerous situation.

    Attributes:
        since: when it began, the blame time [s].
        response: the direction in which the distance became unsafe last and the response is due.
    """

    since: float
    response: Literal["longitudinal", "lateral"]


@ASSERTIONS.register("rss")
class RssAssertion(MarginAssertion):
    """In a situation that RSS calls dangerous the ego responds properly (arXiv 1708.06374).

    Precondition: the longitudinal and the lateral distance to a body not behind the moving ego
    become unsafe. The response is due in the direction that became unsafe last. Longitudinal: for
    ``rho`` the ego accelerates by at most ``a_max_accel``, then brakes by at least ``b_min``
    (``b_min_correct`` before oncoming traffic) until the distance is safe or it stands. Lateral
    (a body cuts or steps in): for ``rho`` it gains speed sideways towards it by at most
    ``a_lat_max_accel``, then brakes sideways by at least ``b_lat_min``; an ego that keeps to its
    lane satisfies this. Violated by less. Robustness: smallest difference of the accelerations
    [m/s2].
    Bodies: testers and background. Defaults: those of CARLA's RSS sensor (RssCheck.cpp), for all
    bodies.
    """

    name: ClassVar[str] = "rss"
    unit: ClassVar[str] = "m/s2"
    PARAMETERS: ClassVar[Mapping[str, str]] = {
        "rho": "response time [s]",
        "a_max_accel": "largest acceleration during the response time [m/s2]",
        "b_min": "smallest braking of a proper response [m/s2]",
        "b_min_correct": "the same before oncoming traffic in the ego's own lane [m/s2]",
        "b_max": "hardest braking of a vehicle ahead [m/s2]",
        "a_lat_max_accel": "largest lateral acceleration during the response time [m/s2]",
        "b_lat_min": "smallest lateral braking of a proper response [m/s2]",
        "mu": "lateral distance that is always kept [m]",
        "lateral_noise": "lateral speed of the ego that is none; it drifts in bends [m/s]",
    }

    def __init__(
        self,
        rho: float = 1.0,
        a_max_accel: float = 3.5,
        b_min: float = 4.0,
        b_min_correct: float = 3.0,
        b_max: float = 8.0,
        a_lat_max_accel: float = 0.2,
        b_lat_min: float = 0.8,
        mu: float = 0.1,
        lateral_noise: float = 0.5,
    ) -> None:
        self.rho = number("rho", rho, 0.0, 10.0)
        self.a_max_accel = number("a_max_accel", a_max_accel, 0.0, 100.0)
        self.b_min = number("b_min", b_min, 0.1, 100.0)
        self.b_min_correct = number("b_min_correct", b_min_correct, 0.1, 100.0)
        self.b_max = number("b_max", b_max, 0.1, 100.0)
        self.a_lat_max_accel = number("a_lat_max_accel", a_lat_max_accel, 0.0, 100.0)
        self.b_lat_min = number("b_lat_min", b_lat_min, 0.1, 100.0)
        self.mu = number("mu", mu, 0.0, 10.0)
        self.lateral_noise = number("lateral_noise", lateral_noise, 0.0, 10.0)

    def reset(self, scene: Scene) -> None:
        super().reset(scene)
        self._dangers: dict[str, Danger] = {}
        self._unsafe: dict[str, tuple[bool, bool]] = {}  # longitudinally, laterally
        self._lateral: tuple[float, float] = (0.0, 0.0)  # the ego's offset [m] and speed [m/s]

    def margins(self, snapshot: Snapshot, before: Snapshot | None) -> Iterator[Margin]:
        accel = acceleration(snapshot, before)
        was, self._lateral = self._lateral, self._sideways(snapshot, before)
        unsafe: dict[str, tuple[bool, bool]] = {}
        dangers: dict[str, Danger] = {}
        for other in relations(self.scene, snapshot, RANGE_M):
            if other.ahead <= 0.0 and not other.in_way:
                continue  # beside the ego
            name = other.body.id
            unsafe[name] = longitudinal, lateral = self._judge(snapshot, other)
            if longitudinal and lateral and snapshot.ego.v > STANDING_MPS:
                dangers[name] = self._dangers.get(name) or self._begun(name, snapshot.time)
                yield name, self._margin(snapshot, other, dangers[name], accel, was[1])
        self._unsafe, self._dangers = unsafe, dangers

    def _judge(self, snapshot: Snapshot, other: Relation) -> tuple[bool, bool]:
        """Whether a body is nearer than is safe, longitudinally and laterally."""
        v, accel = snapshot.ego.v, self.a_max_accel
        if other.onward < -STANDING_MPS:
            safe = rss_longitudinal_opposite(
                v, other.onward, self.rho, accel, self.b_min_correct, self.b_min
            )
        else:
            onward = max(0.0, other.onward)
            safe = rss_longitudinal(v, onward, self.rho, accel, self.b_min, self.b_max)
        return other.ahead < float(safe), other.aside < self._beside(other)

    def _beside(self, other: Relation) -> float:
        """The safe lateral distance; speeds as from the left of the two [m]."""
        own = self._towards(other, self._lateral[1])
        own = own if abs(own) > self.lateral_noise else 0.0
        safe = rss_lateral(
            own, -other.sideways, self.rho, self.a_lat_max_accel, self.b_lat_min, self.mu
        )
        return float(safe)

    def _begun(self, name: str, now: float) -> Danger:
        """A situation that has just become dangerous, by the distance unsafe last."""
        longitudinal, lateral = self._unsafe.get(name, (False, False))
        return Danger(now, "lateral" if longitudinal and not lateral else "longitudinal")

    def _margin(
        self, snapshot: Snapshot, other: Relation, danger: Danger, accel: float, v_before: float
    ) -> float:
        """Margin of the ego's response to the least proper one [m/s2]."""
        elapsed = snapshot.time - danger.since
        responding = elapsed > self.rho + self.scene.dt - 1e-9
        if danger.response == "longitudinal":
            if elapsed <= 0.0:
                return self.a_max_accel  # its acceleration before that does not count
            least = self.b_min_correct if other.onward < -STANDING_MPS else self.b_min
            return SLACK + ((-accel - least) if responding else (self.a_max_accel - accel))
        towards = self._towards(other, self._lateral[1])
        if elapsed <= 0.0 or towards <= self.lateral_noise:
            return self.a_lat_max_accel
        gained = (towards - self._towards(other, v_before)) / self.scene.dt
        return SLACK + (-gained - self.b_lat_min if responding else self.a_lat_max_accel - gained)

    def _towards(self, other: Relation, leftwards: float) -> float:
        """A lateral speed of the ego as one towards a body."""
        return leftwards if other.left else -leftwards

    def _sideways(self, snapshot: Snapshot, before: Snapshot | None) -> tuple[float, float]:
        """The ego's offset from its path to the left, and its rate of change."""
        offset = self.scene.ego_projection(snapshot).lateral
        speed = 0.0 if before is None else (offset - self._lateral[0]) / self.scene.dt
        return offset, speed
