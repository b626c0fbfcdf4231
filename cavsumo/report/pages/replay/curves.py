"""The curves of the page over time: the ego's speed, the gap and the time to collision.

* gap: the smallest distance between the ego's box and a tester's [m], 0 where they touch;
* time to collision: gap / closing speed, the closing speed being that of the two centres along the
  line between them; the smallest over the testers that come nearer, none without such testers.
  Testers count if they are on the carriageway or entering it, or touch the ego; the ego passes
  those that stay on the pavement.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from shapely.geometry import LineString

from cavsumo.model.carriageway import Roads
from cavsumo.model.geometry import Box, gap
from cavsumo.results.traces import Shape

CLOSING_MPS = 0.01  # a slower approach does not count
ENTERING_S = 1.0  # a body whose front is on the carriageway within this time is entering it


class CurvePoint(NamedTuple):
    """The curves at one timestep."""

    speed: float  # of the ego [m/s]
    gap: float | None  # None without testers [m]
    ttc: float | None  # s


def moment(
    frame: Mapping[str, Any], shapes: Mapping[str, Shape], roads: Roads | None = None
) -> CurvePoint:
    """The curves at a frame of a trace; without roads all of the plane is a carriageway."""
    ego = frame["ego"]
    own = _box(ego, shapes["ego"])
    near: list[tuple[float, float | None]] = []
    for name, state in frame["testers"].items():
        distance = gap(own, _box(state, shapes[name]))
        counts = distance == 0.0 or roads is None or on_or_entering(roads, state, shapes[name])
        near.append((distance, time_to_collision(distance, ego, state) if counts else None))
    times = [t for _, t in near if t is not None]
    return CurvePoint(ego[2], min((d for d, _ in near), default=None), min(times, default=None))


def time_to_collision(distance: float, ego: list[float], other: list[float]) -> float | None:
    """Gap / closing speed along the line of centres [s]; None when they do not come nearer.

    The states are [x, y, v, o].
    """
    dx, dy = other[0] - ego[0], other[1] - ego[1]
    apart = math.hypot(dx, dy)
    if distance == 0.0 or apart == 0.0:
        return 0.0
    vx = other[2] * math.cos(other[3]) - ego[2] * math.cos(ego[3])
    vy = other[2] * math.sin(other[3]) - ego[2] * math.sin(ego[3])
    closing = -(dx * vx + dy * vy) / apart
    return distance / closing if closing > CLOSING_MPS else None


def on_or_entering(roads: Roads, state: list[float], shape: Shape) -> bool:
    """Whether a body's centre is on the carriageway, or its front will be within ``ENTERING_S``.

    The state is [x, y, v, o]. One that stands enters nothing.
    """
    x, y, v, o = state
    if roads.contains(x, y):
        return True
    if v <= 0.0:
        return False
    ahead = shape.length / 2 + v * ENTERING_S
    way = LineString([(x, y), (x + ahead * math.cos(o), y + ahead * math.sin(o))])
    return bool(roads.carriageway.intersects(way))


def _box(state: list[float], shape: Shape) -> Box:
    """The box of a body in a frame."""
    return Box(state[0], state[1], state[3], shape.length, shape.width)
