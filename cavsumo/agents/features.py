"""The features of the Q-learning tester: one body against the ego, after a look-ahead.

The ego is expected to keep its speed along its path; the body is expected to follow the target.
"""

from __future__ import annotations

import math

from cavsumo.agents.triggers import MAX_DECEL, REACTION_TIME, time_to_walk
from cavsumo.agents.walking import walk
from cavsumo.model.bodies import Action
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.model.stopping_zones import stopping_distances

# Targets of a decision: whether to move, and the heading relative to the way across the road.
TARGETS: tuple[tuple[bool, float], ...] = (
    (False, 0.0),
    (True, 0.0),
    (True, math.pi / 2),
    (True, math.pi),
    (True, -math.pi / 2),
)


def across(scene: Scene, index: int) -> float:
    """The heading of a body's way across the road, or that of its start if there is none [rad]."""
    way = scene.way(index)
    return way.heading if way else scene.starts[index].o


def towards(state: BodyState, way: float, target: int, dt: float) -> Action:
    """Throttle and steering towards one of TARGETS, where ``way`` is the result of ``across``."""
    moving, turn = TARGETS[target]
    return walk(state, way + turn if moving else state.o, moving * state.body.kind.v_max, dt)


FEATURES = (
    "bias",  # 1
    "near",  # closeness of the ego ahead: 1 here, 0 from 50 m on or when it has passed
    "timely",  # walking across and entering the ego's strip inside its reaction zone
    "late",  # walking across and entering it inside the braking zone or the ego
    "early",  # walking across and entering it long before the reaction zone arrives
    "waiting",  # not walking across while the ego is still to come
    "beside",  # share of the way to the ego's strip that is still to go, at most 1
)
LOOK_M = 50.0  # m


class Features:
    """f(s, a) for one body: a number in [0, 1] for each of FEATURES."""

    def __init__(self, scene: Scene, index: int) -> None:
        self.scene, self.index = scene, index
        self.across = across(scene, index)
        self._seen: tuple[Snapshot, tuple[float, float, float]] | None = None

    def values(self, snapshot: Snapshot, target: int) -> list[float]:
        """The features of choosing a target now."""
        if self._seen is None or self._seen[0] is not snapshot:
            self._seen = snapshot, self._look(snapshot)  # the same for every target
        ahead, beside, gap = self._seen[1]
        braking, reaction = stopping_distances(
            snapshot.ego.v, max_decel=MAX_DECEL, reaction_time=REACTION_TIME
        )
        coming = ahead > 0.0
        crossing = target == 1 and coming
        return [
            1.0,
            max(0.0, 1.0 - ahead / LOOK_M) if coming else 0.0,
            float(crossing and braking < gap <= braking + reaction),
            float(crossing and gap <= braking),
            float(crossing and gap > braking + reaction),
            float(coming and target != 1),
            min(1.0, beside / 10.0),
        ]

    def _look(self, snapshot: Snapshot) -> tuple[float, float, float]:
        """Distance of the ego ahead, distance to its strip, and the gap on entering it [m]."""
        state = snapshot.testers[self.index]
        meeting = self.scene.ego_path.meet(state.x, state.y, self.across)
        if meeting is None:
            return -1.0, 0.0, 0.0
        ego, kind = snapshot.ego, state.body.kind
        front = self.scene.ego_progress(snapshot) + ego.body.kind.length / 2
        ahead = meeting[1] - kind.width / 2 - front
        beside = max(0.0, meeting[0] - ego.body.kind.width / 2 - kind.length / 2)
        return ahead, beside, ahead - ego.v * time_to_walk(kind, state.v, beside)
