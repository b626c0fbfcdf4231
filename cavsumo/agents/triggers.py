"""When a programmed behaviour starts: by distance to the ego, or timed to its arrival."""

from __future__ import annotations

import math
from typing import Protocol

from cavsumo.agents.planning.coordinates import meeting
from cavsumo.model.bodies import Kind, detour
from cavsumo.model.carriageway import Crossing
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

# The zones that the timing trigger aims at: CAV-Gym's, as in the reaction-zone assertion.
MAX_DECEL, REACTION_TIME = 9.0, 0.675  # m/s2, s
# The near end of the reaction zone is avoided by this share of it: the walk is only estimated.
MARGIN = 0.1
ROUNDING_M = 1e-6  # far above the rounding of any distance


class Trigger(Protocol):
    """The seed's trigger phi: whether a body's behaviour starts in this state."""

    def __call__(self, snapshot: Snapshot, state: BodyState) -> bool: ...


def ego_distance(snapshot: Snapshot, state: BodyState) -> float:
    """Distance between the centres of the ego and a body [m]."""
    return math.hypot(state.x - snapshot.ego.x, state.y - snapshot.ego.y)


def distance_ahead(snapshot: Snapshot, state: BodyState) -> float:
    """Distance of a body ahead of the ego, negative behind it [m]."""
    ego = snapshot.ego
    return (state.x - ego.x) * math.cos(ego.o) + (state.y - ego.y) * math.sin(ego.o)


class Proximity:
    """Holds while the body is closer to the ego than a distance [m]."""

    def __init__(self, distance_m: float) -> None:
        self.distance_m = distance_m

    def __call__(self, snapshot: Snapshot, state: BodyState) -> bool:
        return ego_distance(snapshot, state) < self.distance_m


class Timing:
    """Holds when a body that goes now meets the ego's path as the ego's reaction zone covers it.

    The ego is expected to keep its speed. The body enters the strip that the ego sweeps after
    t_e seconds; the gap from the ego's front to the body is then
    ``gap = distance - v_ego * t_e``, and the step is timed when d_b < gap <= d_b + aim * d_r,
    with d_b and d_r the lengths of the braking and the reaction zone (and a margin to d_b).

    Args:
        aim: part of the reaction zone into which to step, in (0, 1]: 1 when its far end arrives,
            small values when its near end does, for egos that brake before the zone is entered.
    """

    def __init__(self, scene: Scene, index: int, aim: float) -> None:
        self.scene, self.aim = scene, aim
        self.ego_half = scene.ego.kind.length / 2
        met = meeting(scene, index)
        self.way = met.way if met else None
        self.meeting = met.along if met else None
        self.strip = met.strip if met else 0.0
        self.point = scene.ego_path.at(self.meeting or 0.0)[:2]
        self._projected = (math.inf, 0.0, 0.0)  # where the ego was, and how far from its path
        self._last: tuple[BodyState, float | None] | None = None

    def __call__(self, snapshot: Snapshot, state: BodyState) -> bool:
        v = snapshot.ego[3]
        braking, reaction = 0.5 * v * v / MAX_DECEL, REACTION_TIME * v  # stopping_distances
        most = braking + self.aim * reaction
        if self.least_gap(snapshot, state) > most + ROUNDING_M:
            return False
        gap = self.gap_at_entry(snapshot, state)
        if gap is None or gap <= 0.0:
            return False
        return braking + MARGIN * reaction < gap <= most

    def least_gap(self, snapshot: Snapshot, state: BodyState) -> float:
        """A lower bound of the gap's size at entry that needs no projection on the path [m].

        An arc is no shorter than its chord, so the ego's projection Q is at least |MQ| from the
        meeting point M along the path, and |MQ| >= |M ego| - |ego Q|. The distance |ego Q| grows by
        at most the way that the ego makes, measured from where it was last projected.
        """
        last = self._last
        entry = last[1] if last is not None and last[0] is state else self._entry(state)
        if entry is None or self.meeting is None:
            return math.inf
        _, x, y, v, _ = snapshot.ego
        mx, my = self.point
        was_x, was_y, lateral = self._projected
        chord = math.hypot(mx - x, my - y) - math.hypot(x - was_x, y - was_y) - lateral
        return chord - state.body.kind.width / 2 - self.ego_half - v * (entry + self.scene.dt)

    def gap_at_entry(self, snapshot: Snapshot, state: BodyState) -> float | None:
        """Distance from the ego's front to the body as it enters the ego's strip [m]."""
        entry = self._entry(state)
        if entry is None or self.meeting is None:
            return None
        ego, here = snapshot.ego, self.scene.ego_projection(snapshot)
        self._projected = ego.x, ego.y, abs(here.lateral)
        front = here.along + self.ego_half
        return self.meeting - state.body.kind.width / 2 - front - ego.v * (entry + self.scene.dt)

    def _entry(self, state: BodyState) -> float | None:
        """``_time_to_enter``, computed once for each state."""
        if self.way is None:
            return None
        if self._last is None or self._last[0] is not state:
            self._last = state, self._time_to_enter(state, self.way)
        return self._last[1]

    def _time_to_enter(self, state: BodyState, way: Crossing) -> float | None:
        """Time that a body that starts now takes to the ego's strip [s]; None beyond its edge."""
        left = self.strip - way.progress(state.x, state.y)
        if left <= 0.0:
            return None
        return time_to_walk(
            state.body.kind, state.v, left + detour(state.body.kind, state.o, way.heading)
        )


def time_to_walk(kind: Kind, v: float, distance: float) -> float:
    """Time to cover a distance from speed v, accelerating to full speed at full throttle [s]."""
    if distance <= 0.0:
        return 0.0
    a, top = kind.throttle_max, kind.v_max
    gaining = (top * top - v * v) / (2.0 * a)
    if gaining >= distance:
        return (math.sqrt(v * v + 2.0 * a * distance) - v) / a
    return (top - v) / a + (distance - gaining) / top
