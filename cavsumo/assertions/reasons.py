"""Reasons of an ego to stop or to brake, in a generous sense."""

from __future__ import annotations

import math

from cavsumo.assertions.contacts import STANDING_MPS
from cavsumo.assertions.red_light import AMBER, RED
from cavsumo.assertions.relations import Relation, front_along, relations
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot
from cavsumo.model.zone_presence import is_vehicle

BESIDE_M = 1.0  # a body this near the ego's strip may be about to enter it


def has_reason(scene: Scene, snapshot: Snapshot, within: float) -> bool:
    """Whether a body or a traffic light within a distance ahead is a reason to stop [m].

    A body in the ego's way or at most a metre beside it, a body that comes towards it, a vehicle
    that moves near it (the ego may have to give way), a light that is not green.
    """
    front = front_along(scene, snapshot)
    for light, shown in zip(scene.lights, snapshot.lights, strict=False):
        if 0.0 <= light.along - front <= within and shown in RED + AMBER:
            return True
    return any(_concerns(other) for other in relations(scene, snapshot, within))


def _concerns(other: Relation) -> bool:
    """Whether a body ahead is a reason to stop."""
    if other.aside <= BESIDE_M:
        return True
    moves = math.hypot(other.onward, other.sideways) > STANDING_MPS
    return moves and (is_vehicle(other.body) or other.sideways > STANDING_MPS)
