"""Motion along a way: phases of constant acceleration one after another, in closed form.

With v0 at the beginning of a phase and a in it, after t seconds::

    v = v0 + a t,    s = v0 t + a t^2 / 2

so a place is exact at any time, for any timestep of the simulation. Before the first phase
and after the last one the speed is constant.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple


class Phase(NamedTuple):
    """A constant acceleration for some time."""

    acceleration: float  # m/s2
    duration: float  # s


@dataclass(frozen=True)
class Motion:
    """Distance and speed as functions of the time since the motion began.

    Attributes:
        speed: at the beginning [m/s].
        phases: one after another.
    """

    speed: float
    phases: tuple[Phase, ...] = ()

    def at(self, time: float) -> tuple[float, float]:
        """Distance [m] and speed [m/s] at a time [s], which may be before the beginning."""
        s, v, left = 0.0, self.speed, time
        if left <= 0.0:
            return v * left, v
        for a, duration in self.phases:
            t = min(left, duration)
            s, v, left = s + v * t + a * t * t / 2, v + a * t, left - t
            if left <= 0.0:
                return s, v
        return s + v * left, v

    def when(self, distance: float) -> float:
        """The time at which a distance >= 0 is covered [s]; infinite if it never is."""
        s, v, time = 0.0, self.speed, 0.0
        for a, duration in self.phases:
            covered = v * duration + a * duration * duration / 2
            if s + covered >= distance:
                return time + _solved(v, a, distance - s)
            s, v, time = s + covered, v + a * duration, time + duration
        return time + _solved(v, 0.0, distance - s)

    @property
    def top_speed(self) -> float:
        """The largest speed [m/s]."""
        v = top = self.speed
        for a, duration in self.phases:
            v += a * duration
            top = max(top, v)
        return top


def _solved(v: float, a: float, distance: float) -> float:
    """The time for a distance at a first speed and an acceleration [s]."""
    if distance <= 0.0:
        return 0.0
    root = v + math.sqrt(max(0.0, v * v + 2.0 * a * distance))
    return 2.0 * distance / root if root > 0.0 else math.inf


def to_speed_over(before: float, after: float, distance: float) -> Phase:
    """The phase that leads from one speed to another over a distance [m/s, m/s, m]."""
    return Phase((after**2 - before**2) / (2.0 * distance), 2.0 * distance / (before + after))


def to_speed_by(before: float, after: float, rate: float) -> Phase:
    """The phase that leads from one speed to another by a rate > 0 [m/s, m/s, m/s2]."""
    return Phase(math.copysign(rate, after - before), abs(after - before) / rate)


def motion_of(speed: float, phases: Iterable[Phase]) -> Motion:
    """A motion without empty phases."""
    return Motion(speed, tuple(one for one in phases if one.duration > 0.0))
