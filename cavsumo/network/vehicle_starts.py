"""The starts and speeds of tester vehicles with which they can meet an unhindered ego.

The ego is expected to drive at the speed limit from its start. A crossing vehicle is placed so that
it would arrive a little earlier, because it can wait but not gain time.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cavsumo.errors import NetworkError
from cavsumo.model.bodies import Kind
from cavsumo.model.carriageway import Approach, Start
from cavsumo.model.geometry import Box, gap

EARLIER_S = (0.5, 3.0)  # by how much a crossing vehicle would arrive before the ego
AHEAD_S = (2.0, 4.0)  # how far ahead of the ego the others start, in seconds of the ego's way
CALM = (
    0.6,
    1.0,
)  # speed of a vehicle that crosses or drives beside, as a share of what it may drive
SLOW = (0.4, 0.7)  # speed of a leader, with which the ego is to catch up
BRAKING_MPS2 = 3.0  # a vehicle starts no faster than it can stop with this before it must wait
APART_M = 3.0  # smallest gap between two bodies at the start
ATTEMPTS = 100


class OnApproach(NamedTuple):
    """A vehicle on an approach, before it is placed.

    Attributes:
        along: its arc length on the path of the approach [m].
        v: its speed on the way to the ego [m/s].
        starts_so: whether it starts with that speed even where it could not stop.
    """

    approach: Approach
    along: float
    v: float
    starts_so: bool

    def start(self) -> Start:
        """Its start; one that waits at its line starts no faster than it can stop."""
        v = self.v
        if math.isfinite(self.approach.wait) and not self.starts_so:
            v = min(v, math.sqrt(2.0 * BRAKING_MPS2 * max(0.0, self.approach.wait - self.along)))
        x, y, o = self.approach.path.at(self.along)
        return Start(x, y, o, approach=self.approach, v=v)


def draw_vehicles(
    approaches: Sequence[Approach],
    kinds: Sequence[Kind],
    ego: Box,
    start_speed: float | None,
    rng: np.random.Generator,
) -> tuple[Start, ...]:
    """One start for each body, apart from each other and from the ego, on different approaches.

    Every approach is as likely as any other, and comes a second time only when all have come or
    are full. Consumes the generator.

    Args:
        ego: the ego's box at its start.
        start_speed: of all vehicles [m/s]; None draws it.

    Raises NetworkError when the bodies do not fit.
    """
    starts: list[Start] = []
    boxes, used = [ego], Counter[Approach]()
    for kind in kinds:
        for attempt in range(ATTEMPTS):
            approach = _choose(approaches, used, rng)
            anywhere = attempt >= ATTEMPTS // 2  # a late vehicle is better than none
            start = _draw(approach, kind, ego, start_speed, anywhere, rng)
            box = Box(start.x, start.y, start.o, kind.length, kind.width)
            if all(gap(box, other) > APART_M for other in boxes):
                starts.append(start)
                boxes.append(box)
                used[approach] += 1
                break
        else:
            raise NetworkError(f"no room for {len(kinds)} vehicles on their approaches: use fewer")
    return tuple(starts)


def _choose(
    approaches: Sequence[Approach], used: Counter[Approach], rng: np.random.Generator
) -> Approach:
    """One of the approaches that came least often so far."""
    least = min(used[a] for a in approaches)
    # Where those are too short for another vehicle, any other will do.
    left = [a for a in approaches if used[a] == least] if rng.random() < 0.9 else list(approaches)
    return left[int(rng.integers(len(left)))]


def _draw(
    approach: Approach,
    kind: Kind,
    ego: Box,
    start_speed: float | None,
    anywhere: bool,
    rng: np.random.Generator,
) -> Start:
    """A start on an approach, in time for the ego unless it may be anywhere."""
    pace = float(rng.uniform(*pace_range(approach)))
    lead = float(rng.uniform(*lead_range(approach)))
    if not anywhere:
        return in_time(approach, kind, ego.length, pace, lead, start_speed).start()
    v, along = _speed(approach, kind, pace, start_speed), rng.uniform(*_room(approach, kind))
    return OnApproach(approach, float(along), v, start_speed is not None).start()


def pace_range(approach: Approach) -> tuple[float, float]:
    """The interval of a vehicle's speed, as a share of what it may drive."""
    return SLOW if approach.type == "following" else CALM


def lead_range(approach: Approach) -> tuple[float, float]:
    """The interval of the time by which a vehicle arrives earlier, or drives ahead [s]."""
    return EARLIER_S if math.isfinite(approach.wait) else AHEAD_S


def in_time(
    approach: Approach,
    kind: Kind,
    ego_length: float,
    pace: float,
    lead: float,
    start_speed: float | None = None,
) -> OnApproach:
    """The vehicle on an approach that meets the ego.

    Args:
        pace: its speed as a share of what it may drive (``pace_range``).
        lead: how much earlier than the ego it arrives, or how far ahead it drives [s].
        start_speed: in place of the pace [m/s].
    """
    v = _speed(approach, kind, pace, start_speed)
    until = approach.ego_enter / approach.ego_speed  # when the ego is there [s]
    if math.isfinite(approach.wait):
        along = min(approach.enter - v * (until - lead), approach.wait)
    else:
        ahead = lead * approach.ego_speed
        along = approach.enter + ahead + (ego_length + kind.length) / 2 - v * until
    first, last = _room(approach, kind)
    return OnApproach(approach, max(first, min(along, last)), v, start_speed is not None)


def _speed(approach: Approach, kind: Kind, pace: float, start_speed: float | None) -> float:
    """The speed of a vehicle on its way to the ego [m/s]."""
    if start_speed is not None:
        return min(kind.v_max, start_speed)
    top = min(kind.v_max, approach.speed)
    return pace * (top if math.isfinite(approach.wait) else min(top, approach.ego_speed))


def _room(approach: Approach, kind: Kind) -> tuple[float, float]:
    """The interval of arc lengths in which a vehicle may start [m]."""
    return kind.length / 2, min(approach.wait, approach.path.length - kind.length / 2)
