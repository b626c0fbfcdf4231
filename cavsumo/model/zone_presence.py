"""How a tester vehicle counts in the stopping zones, where a standing body counts as it stands.

The zones say what an ego that brakes at once, or after its reaction time, would still touch; that
is a question of where a body *will be*. Someone on foot is taken to be where it is, as CAV-Gym
does. A vehicle is not, or whoever drives ahead at an ordinary distance would be in the zones.
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
    """Whether a body counts as this module says."""
    return body.body.kind.name not in WALKING


def drift(onward: float, v: float, max_decel: float) -> float:
    """How much farther ahead of the ego a vehicle counts than where it is [m].

    Both brake: who drives ahead at the speed ``onward`` still makes onward^2 / (2 max_decel), as
    in RSS (Shalev-Shwartz et al., arXiv:1708.06374, definition 1, without a response time). Who
    comes towards the ego (onward < 0) keeps its speed for the v / max_decel seconds that the ego
    takes to stand.
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

    While the ego turns, its zones sweep over lanes that its path does not; who waits or drives
    there is no test.
    """
    if abs(path.project(ego.x, ego.y).lateral) > ON_PATH_M:
        return False
    sides = [path.project(x, y).lateral for x, y in corners(body.box)]
    half = ego.body.kind.width / 2
    return min(sides) > half or max(sides) < -half


def ran_into(body: BodyState, ego: BodyState, dt: float) -> bool:
    """Whether a vehicle that touches the ego touches its sides or rear only, not its front."""
    length, width = ego.body.kind.length, ego.body.kind.width
    depth = BUMPER_M + ego.v * dt
    ahead = (length - depth) / 2 + BUMPER_M / 2
    front = Box(
        ego.x + ahead * math.cos(ego.o), ego.y + ahead * math.sin(ego.o), ego.o, depth, width
    )
    return not overlap(front, body.box)


def drives_clear(body: BodyState, ego: BodyState) -> bool:
    """Whether a vehicle drives ahead no slower than the ego."""
    return ego.v > 0.0 and body.v * math.cos(body.o - ego.o) >= ego.v
