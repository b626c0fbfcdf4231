"""Driving of a vehicle: along lanes by pure pursuit, slowly in bends, at a distance to bodies
ahead.

Every movement is an action of the body's two effectors; nothing here moves a body by itself.

Pure pursuit (Coulter, CMU-RI-TR-92-01) steers so that the circle on which a body moves leads
through a point of the path ahead of it. The seed's body moves its centre in the direction o + beta
on a circle of radius (b / 2) / sin(beta) (see ``kinematics``). A point at the distance L and at
the angle alpha from the orientation lies on that circle when the chord to it is half the turn
off the tangent, sin(alpha - beta) = (L / b) sin(beta), that is

    tan(beta) = sin(alpha) / (L / b + cos(alpha)),    tan(e) = 2 tan(beta).

So it is the body's centre that follows the path, without an error where the path is an arc.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import lru_cache

from cavsumo.model.bodies import Action, Kind
from cavsumo.model.polyline import Path, Projection
from cavsumo.model.snapshot import BodyState

LATERAL_MPS2 = 2.5  # acceleration sideways that bounds the speed in bends
GAINING_MPS2 = 2.5  # throttle of a calm driver
BRAKING_MPS2 = 3.0  # its brake, where it sees the reason in time
HARDEST_MPS2 = 9.0  # brake that others are taken to have
HASTE_MPS2 = 4.0  # throttle of a driver who does not give way
LOOK_S = 0.4  # the point pursued lies so far ahead, in seconds of the way
NEAREST_LOOK = 0.5  # but no nearer than this many wheelbases
NEAREST_LOOK_M = 2.0
SEEN_M = 40.0  # bodies farther away are ignored
KEEP_M = 2.0  # gap kept to a standing body ahead
BESIDE_M = 0.3  # distance at the side of a body that is passed
PATIENCE_S = 12.0  # a drive is not foreseen for longer
RUN_OUT_M = 12.0  # a vehicle so far beyond the end of its path has left the road


class Course:
    """A path as one body drives along it.

    Arc lengths are those of the body's centre; beyond its end the path is straight.

    Args:
        top: speed limit on the path [m/s].
    """

    def __init__(self, path: Path, kind: Kind, dt: float, top: float) -> None:
        self.path, self.kind, self.dt = path, kind, dt
        self._limits = speed_limits(path, min(top, kind.v_max))
        self._segment: int | None = None
        self._last: tuple[BodyState, float, float] | None = None

    def place(self, state: BodyState) -> tuple[float, float]:
        """Arc length and lateral offset of a body, positive to the left [m]."""
        if self._last is None or self._last[0] is not state:
            here = self.path.project(state.x, state.y, self._segment)
            self._segment = here.segment
            self._last = state, *self._prolonged(here, state)
        return self._last[1], self._last[2]

    def _prolonged(self, here: Projection, state: BodyState) -> tuple[float, float]:
        """Arc length and lateral offset; beyond its end the path is straight [m]."""
        if here.along < self.path.length:
            return here.along, here.lateral
        x, y, o = self.path.at(self.path.length)
        dx, dy, cos, sin = state.x - x, state.y - y, math.cos(o), math.sin(o)
        return here.along + max(0.0, dx * cos + dy * sin), dy * cos - dx * sin

    def limit(self, along: float) -> float:
        """The speed at which the bends from here on can be driven, braking in time [m/s]."""
        last = len(self._limits) - 1
        i = min(last, max(0, int(along)))
        v, w = self._limits[i], self._limits[min(last, i + 1)]
        return math.sqrt(v * v + (w * w - v * v) * min(1.0, max(0.0, along - i)))

    def steering(self, state: BodyState, look: float = 0.0) -> float:
        """The steering angle towards the point pursued, at least ``look`` metres ahead [rad]."""
        kind = self.kind
        look = max(look, look_ahead(kind, state.v, self.dt))
        x, y, _ = self.path.at(self.place(state)[0] + look)
        return steer_at(state, x, y)

    def drive(
        self,
        state: BodyState,
        allowed: float,
        *,
        gaining: float = GAINING_MPS2,
        look: float = 0.0,
    ) -> Action:
        """Follow the path at the speed that it and ``allowed`` [m/s] permit."""
        kind, v = self.kind, state.v
        speed = min(allowed, self.limit(self.place(state)[0] + v * self.dt))
        throttle = min(gaining, kind.throttle_max, (speed - v) / self.dt)
        return Action(max(kind.throttle_min, throttle), self.steering(state, look))

    def time_to(
        self, state: BodyState, there: float, gaining: float = HASTE_MPS2
    ) -> tuple[float, float]:
        """Time and speed at which a body that drives on at once reaches an arc length [s, m/s].

        At most PATIENCE_S; as in the kinematics, with the old speed for the position.
        """
        along, v, time, dt = self.place(state)[0], state.v, 0.0, self.dt
        while along < there and time < PATIENCE_S:
            along += v * dt
            time += dt
            v = max(v - BRAKING_MPS2 * dt, min(self.limit(along + v * dt), v + gaining * dt))
        return time, v

    def room(self, state: BodyState, others: Iterable[BodyState]) -> float:
        """The speed at which a body still keeps its distance to all ahead on its path [m/s]."""
        here, _ = self.place(state)
        cos, sin = math.cos(state.o), math.sin(state.o)
        allowed = math.inf
        for other in others:
            dx, dy = other.x - state.x, other.y - state.y
            if abs(dx) > SEEN_M or abs(dy) > SEEN_M or dx * cos + dy * sin <= 0.0:
                continue
            there, lateral = self._prolonged(self.path.project(other.x, other.y), other)
            axis = self.path.at(there)[2]
            along, across = extent(other, axis)
            gap = there - here - along - self.kind.length / 2
            if gap + along <= 0.0 or abs(lateral) > across + self.kind.width / 2 + BESIDE_M:
                continue
            onward = max(0.0, other.v * math.cos(other.o - axis))
            allowed = min(allowed, stopping_from(gap - KEEP_M - state.v * self.dt, onward, self.dt))
        return allowed


def look_ahead(kind: Kind, v: float, dt: float) -> float:
    """Distance of the pursued point ahead [m]."""
    return max(NEAREST_LOOK * kind.wheelbase, NEAREST_LOOK_M, max(LOOK_S, 2.0 * dt) * v)


def steer_at(state: BodyState, x: float, y: float) -> float:
    """The steering angle whose circle leads through a point, within the kind's limits [rad]."""
    kind = state.body.kind
    dx, dy = x - state.x, y - state.y
    alpha = math.remainder(math.atan2(dy, dx) - state.o, math.tau)
    # A point behind is out of reach: turn towards it at full steering.
    room = math.hypot(dx, dy) / kind.wheelbase + math.cos(alpha)
    wanted = math.atan2(2.0 * math.sin(alpha), max(room, 0.0))
    return min(kind.steering_max, max(-kind.steering_max, wanted))


def within_turn(action: Action, state: BodyState, lateral: float) -> Action:
    """An action whose turn accelerates a body sideways by no more than that [m/s2].

    On its circle the acceleration is v^2 sin(beta) / (b / 2), and tan(e) = 2 tan(beta).
    """
    sine = lateral * state.body.kind.wheelbase / (2.0 * max(state.v, 1e-9) ** 2)
    if sine >= 1.0:
        return action
    most = math.atan(2.0 * math.tan(math.asin(sine)))
    return action._replace(steering=max(-most, min(most, action.steering)))


def stopping_from(distance: float, onward: float, dt: float) -> float:
    """The largest speed from which a body still stops in time [m/s].

    The distance is that to a body ahead at the speed ``onward``, which may brake with HARDEST_MPS2:
    v^2 / (2 b) + v dt <= distance + onward^2 / (2 HARDEST_MPS2), with the calm driver's brake for
    b.
    """
    b, way = BRAKING_MPS2, distance + onward * onward / (2.0 * HARDEST_MPS2)
    if way <= 0.0:
        return 0.0
    return math.sqrt((b * dt) ** 2 + 2.0 * b * way) - b * dt


def extent(body: BodyState, axis: float) -> tuple[float, float]:
    """Extent of a body's box from its centre along an axis and across it [m]."""
    kind, turn = body.body.kind, body.o - axis
    c, s = abs(math.cos(turn)), abs(math.sin(turn))
    return (kind.length * c + kind.width * s) / 2, (kind.length * s + kind.width * c) / 2


@lru_cache(maxsize=256)  # paths are compared by identity and live as long as the site
def speed_limits(path: Path, top: float) -> tuple[float, ...]:
    """The largest speed at each metre of a path [m/s].

    In a bend of radius R at most sqrt(LATERAL_MPS2 R), and before it at most the speed from which
    BRAKING_MPS2 reaches that limit in time.
    """
    marks = range(math.ceil(path.length) + 1)
    bends = (max(1e-9, path.curvature(float(s))) for s in marks)
    limits = [min(top, math.sqrt(LATERAL_MPS2 / bend)) for bend in bends]
    for i in reversed(range(len(limits) - 1)):
        limits[i] = min(limits[i], math.sqrt(limits[i + 1] ** 2 + 2.0 * BRAKING_MPS2))
    return tuple(limits)
