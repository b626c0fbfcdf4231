"""The observation of a learning tester: one flat vector of numbers for a team of bodies.

The numbers are those that decide a test, in coordinates in which all roads look alike. A body has
a *way* into the strip that the ego sweeps: on foot straight at the ego's path, from the side on
which it started; in a vehicle along its lanes (``Approach``). Three groups of entries:

============================ ====== ============================================================
entry                        unit   meaning
============================ ====== ============================================================
``ego.speed_mps``            m/s    the ego's speed
``ego.steering_rad``         rad    its steering angle, positive to the left
``ego.left_m``               m      length of its path ahead of its front
``bodyI.ahead_m``            m      from the ego's front, along its path, to the near side of the
                                    I-th owned body where it enters the strip; negative behind
``bodyI.strip_m``            m      way of that body's front to the strip; negative in and beyond it
``bodyI.entry_s``            s      time to get there from now on, turning first, at full throttle
``bodyI.timing``             1      where in the ego's zones it would then be, if the ego kept its
                                    speed: 0 to 1 is the reaction zone from its near to its far
                                    end, below that the braking zone and the ego, above it nothing
``bodyI.speed_mps``          m/s    the body's speed
``bodyI.sin``, ``bodyI.cos`` 1      of its heading relative to its way, positive to the left
``bodyI.offset_m``           m      on foot: how far along the road it went from where it started,
                                    positive to the left of its way; else: its distance from the
                                    lane's middle, positive to the left
``bodyI.on_road``            1      whether its centre is on the carriageway
``other.ahead_m``            m      as above, for the tester of another team next ahead of the ego
``other.beside_m``           m      its distance from the ego's path, to either side
``other.speed_mps``          m/s    its speed
============================ ====== ============================================================

Every entry is clipped into its bounds. Where there is no other tester ahead of the ego, it is at
its upper bounds and stands. The zones are those of the reaction-zone assertion by default.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cavsumo.agents.triggers import MAX_DECEL, REACTION_TIME, time_to_walk
from cavsumo.model.bodies import detour
from cavsumo.model.kinematics import wrap
from cavsumo.model.polyline import Projection
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

VERSION = 1  # changes with the meaning of any entry
FAR_M, BESIDE_M, ENTRY_S, TIMING = 100.0, 30.0, 30.0, 3.0  # bounds of the entries
SHORTEST_M = 0.1  # a reaction zone is taken to be this long at least: the ego stands then
EGO_SPEED = 30.0  # m/s

Bounds = tuple[str, float, float]


def entries(bodies: int, v_max: float, steering_max: float) -> tuple[Bounds, ...]:
    """Name, lower and upper bound of every entry.

    Args:
        bodies: how many the team owns.
        v_max: the largest speed of a tester's body [m/s].
        steering_max: the largest steering angle of the ego [rad].
    """
    mine = (
        ("ahead_m", -FAR_M, FAR_M),
        ("strip_m", -BESIDE_M, FAR_M),
        ("entry_s", 0.0, ENTRY_S),
        ("timing", -TIMING, TIMING),
        ("speed_mps", 0.0, v_max),
        ("sin", -1.0, 1.0),
        ("cos", -1.0, 1.0),
        ("offset_m", -BESIDE_M, BESIDE_M),
        ("on_road", 0.0, 1.0),
    )
    return (
        ("ego.speed_mps", 0.0, EGO_SPEED),
        ("ego.steering_rad", -steering_max, steering_max),
        ("ego.left_m", 0.0, FAR_M),
        *((f"body{i}.{name}", low, high) for i in range(bodies) for name, low, high in mine),
        ("other.ahead_m", 0.0, FAR_M),
        ("other.beside_m", 0.0, BESIDE_M),
        ("other.speed_mps", 0.0, v_max),
    )


class TeamObserver:
    """Observations of one episode for the owner of some bodies; made anew at each reset.

    Attributes:
        names: of the entries.
        low, high: their bounds, float32 of shape (len(names),).
    """

    def __init__(self, scene: Scene, team: Sequence[int]) -> None:
        self._scene, self._team = scene, tuple(team)
        self._others = tuple(i for i in range(len(scene.bodies)) if i not in self._team)
        v_max = max(body.kind.v_max for body in scene.bodies)
        table = entries(len(self._team), v_max, scene.ego.kind.steering_max)
        self.names = tuple(name for name, _, _ in table)
        self._bounds = [(low, high) for _, low, high in table]
        self.low = np.array([low for _, low, _ in table], dtype=np.float32)
        self.high = np.array([high for _, _, high in table], dtype=np.float32)
        self._half_ego = scene.ego.kind.length / 2
        ways = [_Way(scene, i) for i in range(len(scene.bodies))]
        self._mine, self._theirs = [ways[i] for i in self._team], [ways[i] for i in self._others]

    def vector(self, snapshot: Snapshot) -> NDArray[np.float32]:
        """The team's observation of a snapshot: float32 of shape (len(names),)."""
        return np.array(self.values(snapshot), dtype=np.float32)

    def values(self, snapshot: Snapshot) -> list[float]:
        """The same as plain floats, before they are rounded to float32."""
        front = self._scene.ego_progress(snapshot) + self._half_ego
        seen = [
            snapshot.ego.v,
            snapshot.ego_steering,
            self._scene.ego_path.length - front,
        ]
        for i, way in zip(self._team, self._mine, strict=True):
            seen += self._own(snapshot, snapshot.testers[i], way, front)
        seen += self._next(snapshot, front)
        return [
            low if value < low else high if value > high else value
            for value, (low, high) in zip(seen, self._bounds, strict=True)
        ]

    def _own(
        self, snapshot: Snapshot, state: BodyState, way: _Way, front: float
    ) -> tuple[float, ...]:
        """The entries of an owned body."""
        meeting, strip, heading, offset, on_road = way.look(state)
        body, _, _, v, o = state
        v_ego = snapshot.ego.v
        ahead = meeting - front
        turn = wrap(o - heading)
        walk = strip + detour(body.kind, o, heading) if strip > 0.0 else 0.0
        entry = time_to_walk(body.kind, v, walk)
        gap = ahead - v_ego * (entry + self._scene.dt)
        braking, reaction = 0.5 * v_ego * v_ego / MAX_DECEL, REACTION_TIME * v_ego
        timing = (gap - braking) / max(reaction, SHORTEST_M)
        return ahead, strip, entry, timing, v, math.sin(turn), math.cos(turn), offset, on_road

    def _next(self, snapshot: Snapshot, front: float) -> tuple[float, float, float]:
        """The entries of the tester of another team that the ego meets next."""
        nearest = (FAR_M, BESIDE_M, 0.0)
        for i, way in zip(self._others, self._theirs, strict=True):
            state = snapshot.testers[i]
            here = way.on_path(state)
            ahead = here.along - state.body.kind.width / 2 - front
            if 0.0 <= ahead < nearest[0]:
                nearest = ahead, abs(here.lateral), state.v
        return nearest


Look = tuple[float, float, float, float, float]


class _Way:
    """The way of one body into the strip that the ego sweeps."""

    def __init__(self, scene: Scene, index: int) -> None:
        self._scene, self._kind = scene, scene.bodies[index].kind
        self._start = scene.starts[index]
        self._half_strip = scene.ego.kind.width / 2
        self._seen: tuple[BodyState, Look] | None = None
        self._projected: tuple[BodyState, Projection] | None = None
        path, start = scene.ego_path, self._start
        first = path.project(start.x, start.y)
        self._side = 1.0 if first.lateral >= 0.0 else -1.0
        self._origin, self._near = first.along, first.segment

    def on_path(self, state: BodyState) -> Projection:
        """Position of a body relative to the ego's path."""
        if self._projected is None or self._projected[0] is not state:
            here = self._scene.ego_path.project(state.x, state.y, self._near)
            self._near, self._projected = here.segment, (state, here)
        return self._projected[1]

    def look(self, state: BodyState) -> Look:
        """The meeting of the ego with a body that goes its way now, and the body's pose on that
        way.

        Arc length of its near side on the ego's path, way to the strip, heading of the way,
        distance beside it, on the carriageway or not (m and rad). Computed once for each state.
        """
        if self._seen is None or self._seen[0] is not state:
            roads = self._scene.roads
            on_road = float(roads is not None and roads.contains(state.x, state.y))
            walks = self._start.approach is None
            seen = self._walking(state) if walks else self._driving(state)
            self._seen = state, (*seen, on_road)
        return self._seen[1]

    def _walking(self, state: BodyState) -> tuple[float, float, float, float]:
        """Straight at the ego's path, from the side on which the body started."""
        here, kind, side = self.on_path(state), self._kind, self._side
        along = self._scene.ego_path.at(here.along)[2]
        strip = side * here.lateral - self._half_strip - kind.length / 2
        # For a body from the left of the path the ego's direction is to the left of its way.
        offset = side * (here.along - self._origin)
        return here.along - kind.width / 2, strip, along - side * math.pi / 2, offset

    def _driving(self, state: BodyState) -> tuple[float, float, float, float]:
        """Along the lanes of the approach."""
        approach = self._start.approach
        assert approach is not None
        here = approach.path.project(state.x, state.y)
        heading = approach.path.at(here.along)[2]
        strip = min(FAR_M, approach.enter - here.along)  # which may be infinite
        return approach.ego_enter, strip, heading, here.lateral
