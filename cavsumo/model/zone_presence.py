"""The position at which a tester vehicle counts in the stopping zones.

The zones contain the places that an ego would still touch if it braked at once, or after its
reaction time; so they concern the position that a body *will have*. A pedestrian counts at its
current position, as in CAV-Gym. A vehicle does not, because otherwise a leader at an ordinary
distance would be in the zones.
"""

from __future__ import annotations

import math

from cavsumo.model.bodies import WALKING
from cavsumo.model.geometry import Box, corners, overlap
from cavsumo.model.polyline import Path
from cavsumo.model.snapshot import BodyState

ON_PATH_M = 0.5  # an ego this close to its path keeps to it
BUMPER_M = 0.3  # depth of the ego's front, to which the way of a timestep is added


def is_vehicle(body: BodyState) -> bool:
    """Whether a body counts as described in this module."""
    return body.body.kind.name not in WALKING


def drift(onward: float, v: float, max_decel: float) -> float:
    """Distance ahead of its current position at which a vehicle counts [m].

    Both brake: a leader at the speed ``onward`` still drives onward^2 / (2 max_decel), as in RSS
        (Shalev-Shwartz et al., arXiv:1708.06374, definition 1, without a response time). An
        oncoming vehicle (onward < 0) keeps its speed for the v / max_decel seconds that the ego
        needs to stop.
    """
    if onward > 0.0:
        return 0.5 * onward * onward / max_decel
    return onward * max(0.0, v) / max_decel


def counted(body: BodyState, ego: BodyState, max_decel: float) -> Box:
    """A vehicle's box where it counts, moved along the ego's heading by its drift."""
    x, y, o, length, width = body.box
    shift = drift(body.v * math.cos(body.o - ego.o), ego.v, max_decel)
    return Box(x + shift * math.cos(ego.o), y + shift * math.sin(ego.o), o, length, width)


def out_of_the_way(body: BodyState, ego: BodyState, path: Path) -> bool:
    """Whether an ego that keeps to its path passes a vehicle where it is.

    While the ego turns, its zones cover lanes that its path does not touch; a vehicle that waits or
    drives there is no test.
    """
    if abs(path.project(ego.x, ego.y).lateral) > ON_PATH_M:
        return False
    sides = [path.project(x, y).lateral for x, y in corners(body.box)]
    half = ego.body.kind.width / 2
    return min(sides) > half or max(sides) < -half


def ran_into(body: BodyState, ego: BodyState, dt: float) -> bool:
    """Whether a vehicle that touches the ego touches only its sides or rear, not its front."""
    length, width = ego.body.kind.length, ego.body.kind.width
    depth = BUMPER_M + ego.v * dt
    ahead = (length - depth) / 2 + BUMPER_M / 2
    front = Box(
        ego.x + ahead * math.cos(ego.o), ego.y + ahead * math.sin(ego.o), ego.o, depth, width
    )
    return not overlap(front, body.box)


def drives_clear(body: BodyState, ego: BodyState) -> bool:
    """Whether a vehicle drives ahead at least as fast as the ego."""
    return ego.v > 0.0 and body.v * math.cos(body.o - ego.o) >= ego.v
