"""The first guess of the last chance: the result of a takeover, predicted without a simulation.

The ego follows its recorded way, the body repeats its recorded motion, then keeps its velocity. The
simulation does the same except in bends and for rounding, so this is only a first guess.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from itertools import accumulate, pairwise

from cavsumo.egos.reference.base import Reference
from cavsumo.model.geometry import Box, overlap
from cavsumo.model.snapshot import BodyState, Snapshot

PATIENCE_S = 60.0  # a reference driver has stopped long before


def foreseen(
    frames: Sequence[Snapshot], bodies: Sequence[BodyState], reference: Reference, dt: float
) -> int:
    """The last timestep at which a takeover is predicted to avoid the contact at the end, -1 for
    none.

    Args:
        frames: up to the contact.
        bodies: the body touched, at each of them.
        dt: length of a timestep [s].
    """
    way = DrivenWay([frame.ego for frame in frames])

    def fails(step: int) -> bool:
        return _touches(way, bodies, step, reference, dt)

    return bisect_left(range(len(frames)), True, key=fails) - 1


class DrivenWay:
    """The way that the ego drove, by arc length; straight beyond its end.

    Attributes:
        states: the ego at each timestep.
        driven: the distance driven by then [m].
    """

    def __init__(self, states: Sequence[BodyState]) -> None:
        self.states = states
        steps = (math.dist(a[1:3], b[1:3]) for a, b in pairwise(states))
        self.driven = list(accumulate(steps, initial=0.0))

    def box(self, along: float) -> Box:
        """The ego's box at an arc length."""
        i = max(0, bisect_right(self.driven, along) - 1)
        x, y, o, length, width = self.states[i].box
        left = along - self.driven[i]
        if i + 1 < len(self.states):
            after = self.states[i + 1]
            share = left / (self.driven[i + 1] - self.driven[i])
            turn = math.remainder(after.o - o, math.tau)
            here = x + share * (after.x - x), y + share * (after.y - y), o + share * turn
            return Box(*here, length, width)
        return Box(x + left * math.cos(o), y + left * math.sin(o), o, length, width)


def _touches(
    way: DrivenWay, bodies: Sequence[BodyState], step: int, reference: Reference, dt: float
) -> bool:
    """Whether the ego, taken over at a timestep, touches the body before it stands."""
    ego, before = way.states[step], way.states[max(0, step - 1)]
    kind, v, along = ego.body.kind, ego.v, way.driven[step]
    kept = min(0.0, (ego.v - before.v) / dt)
    for i in range(step, step + round(PATIENCE_S / dt)):
        if overlap(way.box(along), _box(bodies, i, dt)):
            return True
        if v <= 0.0:
            return False
        braking = reference.throttle((i - step) * dt, dt, kind)
        v = max(0.0, v + min(kept, braking) * dt)
        along += v * dt
    return False


def _box(bodies: Sequence[BodyState], step: int, dt: float) -> Box:
    """The box of a body, which keeps its velocity after its last known state."""
    if step < len(bodies):
        return bodies[step].box
    x, y, o, length, width = bodies[-1].box
    way = bodies[-1].v * (step - len(bodies) + 1) * dt
    return Box(x + way * math.cos(o), y + way * math.sin(o), o, length, width)
