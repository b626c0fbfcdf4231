"""The parameters of a game of a walking tester against an ego."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from dataclasses import dataclass

from cavsumo.model.bodies import Kind

INTERVAL_S = 0.5  # between two decisions of the lattice
VERSION = 1  # of the construction; a new version invalidates stored solutions


@dataclass(frozen=True)
class Rules:
    """A lattice on which walking and driving are exact, with the prices of the outcomes.

    Both players keep an acceleration for an interval D. Speeds are multiples of a D, so the ways
    are multiples of a D^2 / 2 and no step ever has to be rounded.

    Attributes:
        walk_top, walk_accel: of the body [m/s], [m/s2].
        left_max: the farthest distance from the strip on the lattice [m].
        speeds: how many speeds the ego has, from ``speed_step`` on in steps of it.
        speed_step: [m/s].
        brake, accelerate: by how many of them its speed changes in an interval, at most.
        gap_step, gap_max: of the gap between the ego and the body [m].
        max_decel: of the braking zone [m/s2]; 0 where gaps are counted from that zone on.
        reaction_time: of the reaction zone [s].
        price: of standing in the ego's way before its reaction zone arrives, a second; a miss
            costs 1, a body that touches the braking zone first 2.
        interval: D [s].
    """

    walk_top: float
    walk_accel: float
    left_max: float
    speeds: int
    speed_step: float
    brake: int
    accelerate: int
    gap_step: float
    gap_max: float
    max_decel: float
    reaction_time: float
    price: float
    interval: float = INTERVAL_S

    @property
    def paces(self) -> int:
        """The number of the body's full speed in steps of a D; 0 is standing."""
        return round(self.walk_top / (self.walk_accel * self.interval))

    @property
    def left_step(self) -> float:
        """Of the walking distance left [m]."""
        return self.walk_accel * self.interval**2 / 2

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Numbers of gaps, speeds, distances left and paces."""
        gaps, lefts = self.gap_max / self.gap_step, self.left_max / self.left_step
        return round(gaps), self.speeds, round(lefts), self.paces + 1

    @property
    def advance(self) -> int:
        """How many gap steps the ego makes in an interval at half a speed step."""
        return round(self.speed_step * self.interval / 2 / self.gap_step)

    @property
    def key(self) -> str:
        """Stands for the game and its solution: a SHA-256."""
        text = json.dumps([VERSION, dataclasses.asdict(self)])
        return hashlib.sha256(text.encode()).hexdigest()


def against_constant(
    kind: Kind, reaction_time: float, left_max: float, price: float, step: float
) -> Rules:
    """The game against an ego that keeps its speed.

    Gaps are counted from the end of the braking zone and in seconds, so there is only one speed, 1.

    Args:
        step: of the time until the braking zone arrives [s], rounded so that half an interval is a
            multiple of it.
    """
    step = INTERVAL_S / 2 / max(1, round(INTERVAL_S / 2 / step))
    late = left_max / kind.v_max + 2.0 * INTERVAL_S + kind.v_max / kind.throttle_max
    return Rules(
        walk_top=kind.v_max,
        walk_accel=kind.throttle_max,
        left_max=left_max,
        speeds=1,
        speed_step=1.0,
        brake=0,
        accelerate=0,
        gap_step=step,
        gap_max=step * round((late + reaction_time) / step),
        max_decel=0.0,
        reaction_time=reaction_time,
        price=price,
    )


def against_any(
    kind: Kind,
    *,
    max_decel: float,
    reaction_time: float,
    top: float,
    accel: float,
    left_max: float,
    price: float,
) -> Rules:
    """The game against an ego that brakes and accelerates freely, but never stops.

    Args:
        top: the speed that it never exceeds [m/s], rounded up to a step.
        accel: its largest acceleration [m/s2], rounded up to a whole part of ``max_decel``; a speed
            step is what it makes in an interval.
    """
    parts = max(1, math.floor(max_decel / accel + 1e-9))
    step = max_decel / parts * INTERVAL_S
    speeds = max(1, math.ceil(top / step - 1e-9))
    late = left_max / kind.v_max + 2.0 * INTERVAL_S
    gap_step = step * INTERVAL_S / 2
    reach = (speeds * step) * (late + reaction_time) + (speeds * step) ** 2 / 2 / max_decel
    return Rules(
        walk_top=kind.v_max,
        walk_accel=kind.throttle_max,
        left_max=left_max,
        speeds=speeds,
        speed_step=step,
        brake=parts,
        accelerate=1,
        gap_step=gap_step,
        gap_max=gap_step * round(reach / gap_step),
        max_decel=max_decel,
        reaction_time=reaction_time,
        price=price,
    )
