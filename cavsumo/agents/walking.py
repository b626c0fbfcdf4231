"""Walking: along the pavement, up to the kerb, across the road. Used by the agents.

Every movement is an action of the body's two effectors; nothing here moves a body by itself.
"""

from __future__ import annotations

import math

from cavsumo.model.bodies import Action, Kind, turn_radius
from cavsumo.model.carriageway import Crossing
from cavsumo.model.kinematics import steering_for_turn, wrap
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState

ALIGNED_RAD = 1e-6  # a heading this close to its target has reached it
KERB_CLEARANCE_M = 0.1  # distance kept to the carriageway while waiting at the kerb
THERE_M = 0.01  # a body this close to its waiting point has arrived
TURN_MARGIN_M = 0.05  # room beyond the turn itself, for the corners of a half-turned box
PAVEMENT_GAIN = 0.5  # how strongly a walker returns to its line on the pavement [rad/m]


def turn_limit(kind: Kind, v: float, dt: float) -> float:
    """The largest turn that full steering makes in one timestep (seed, eq. 15) [rad]."""
    return 2.0 * v * dt / kind.wheelbase * kind.turning


def room_to_turn(kind: Kind, turn: float) -> float:
    """Distance covered along a heading while turning to it at full steering [m].

    The body moves at beta off its orientation, so with phi the turn left to make the integral of
    rho cos(phi - beta) from phi to 0 is rho (sin(phi - beta) + sin beta).
    """
    beta = math.atan(0.5 * math.tan(kind.steering_max))
    return turn_radius(kind) * (math.sin(turn - beta) + math.sin(beta))


def steer_to(state: BodyState, heading: float, dt: float) -> float:
    """The steering angle that turns a body to a heading as fast as it can [rad]."""
    body, _, _, v, o = state
    if heading == o or v <= 0.0:
        return 0.0
    turn = wrap(heading - o)
    if abs(turn) < 1e-12:
        return 0.0
    kind = body.kind
    if abs(turn) >= turn_limit(kind, v, dt):
        return math.copysign(kind.steering_max, turn)
    return steering_for_turn(v, turn, kind.wheelbase, dt)


def throttle_to(state: BodyState, speed: float, dt: float) -> float:
    """The throttle that brings a body to a speed as fast as it can [m/s2]."""
    kind, throttle = state.body.kind, (speed - state.v) / dt
    if throttle <= kind.throttle_min:
        return kind.throttle_min
    return kind.throttle_max if throttle > kind.throttle_max else throttle


def walk(state: BodyState, heading: float, speed: float, dt: float) -> Action:
    """Turn to a heading and take a speed."""
    return Action(throttle_to(state, speed, dt), steer_to(state, heading, dt))


def stopping_speed(kind: Kind, distance: float, dt: float) -> float:
    """The largest speed from which a body still stops within a distance [m/s].

    From v^2 / (2 b) + v dt <= distance: the position follows one timestep behind the throttle.
    """
    if distance <= 0.0:
        return 0.0
    b = -kind.throttle_min
    return min(kind.v_max, math.sqrt((b * dt) ** 2 + 2.0 * b * distance) - b * dt)


class CrossingWalk:
    """The programmed behaviour of the seed's agents: across the road, then on as before.

    Begins where the body stands, keeps to the straight line across, ends behind the far kerb by
    turning back to the old orientation (CAV-Gym's CrossingAgent).
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.crossing: Crossing | None = None
        self.turning_back = False
        self.prior = 0.0
        self.heading = 0.0  # the one that it takes

    @property
    def active(self) -> bool:
        """Whether the behaviour is under way."""
        return self.crossing is not None

    def begin(self, state: BodyState) -> bool:
        """Start crossing from here; False where there is no road to cross."""
        if self.scene.roads is None:
            return False
        self.crossing = self.scene.roads.crossing(state.x, state.y)
        self.turning_back = False
        self.prior = state.o
        return self.active

    def over(self, state: BodyState) -> bool:
        """The terminator psi: behind the far kerb, and turned back to the old orientation."""
        return self._across(state) and abs(wrap(self.prior - state.o)) < ALIGNED_RAD

    def end(self) -> None:
        """Stop being active."""
        self.crossing = None

    def action(self, state: BodyState) -> Action:
        """The next action while active; ends the behaviour when it has arrived."""
        assert self.crossing is not None
        over, self.turning_back = self.over(state), self._across(state)
        self.heading = self.prior if self.turning_back else self.crossing.heading
        action = walk(state, self.heading, state.body.kind.v_max, self.scene.dt)
        if over:
            self.end()
        return action

    def _across(self, state: BodyState) -> bool:
        """Whether a body is, or was, at the end of the way across."""
        if self.crossing is None:
            return False
        done = self.crossing.progress(state.x, state.y) >= self.crossing.length
        return self.turning_back or done


class Stroll:
    """Walk along the pavement of the start, at full speed, and stop at its end."""

    def __init__(self, scene: Scene, index: int) -> None:
        self.dt, self.start = scene.dt, scene.starts[index]
        self.forwards, self.lateral = self.start.forwards, self.start.lateral
        self.segment: int | None = None

    def turn_back(self, state: BodyState) -> None:
        """Walk the other way from now on, on a line so far to the inner side as the turn takes."""
        self.forwards = not self.forwards
        self.lateral -= math.copysign(2.0 * turn_radius(state.body.kind), self.lateral)

    def action(self, state: BodyState) -> Action:
        """The next action; straight on for a body that started away from any pavement."""
        start, kind = self.start, state.body.kind
        if start.pavement is None:
            return walk(state, state.o, kind.v_max, self.dt)
        here = start.pavement.project(state.x, state.y, self.segment)
        self.segment = here.segment
        _, _, axis = start.pavement.at(here.along)
        left = here.along if not self.forwards else start.pavement.length - here.along
        correction = max(-0.5, min(0.5, PAVEMENT_GAIN * (self.lateral - here.lateral)))
        heading = axis + correction if self.forwards else axis + math.pi - correction
        allowed = stopping_speed(kind, left - state.v * self.dt, self.dt)
        return walk(state, heading, allowed, self.dt)


class ApproachKerb:
    """Go straight to the kerb and wait there, facing the road, at a distance from it [m]."""

    def __init__(self, scene: Scene, index: int, clearance: float = KERB_CLEARANCE_M) -> None:
        self.dt = scene.dt
        self.way = scene.way(index)
        kind = scene.bodies[index].kind
        self.stop = (self.way.enter if self.way else 0.0) - kind.length / 2 - clearance
        self.turning = False
        self._last: tuple[BodyState, Action] | None = None

    def action(self, state: BodyState) -> Action:
        """The next action; most of the time the body stands, and nothing has changed."""
        if self._last is None or self._last[0] is not state:
            self._last = state, self._approach(state)
        return self._last[1]

    def left(self, state: BodyState) -> float:
        """How far it still goes [m]."""
        if self.way is None:
            return 0.0
        return max(0.0, self.stop - self.way.progress(state.x, state.y))

    def _approach(self, state: BodyState) -> Action:
        """Walk up to the kerb; a body too fast to stop there brakes before it turns."""
        kind = state.body.kind
        if self.way is None:
            return walk(state, state.o, 0.0, self.dt)
        left = self.stop - self.way.progress(state.x, state.y)
        if left < THERE_M:
            return walk(state, state.o, 0.0, self.dt)  # or it would creep on for ever
        # This timestep's way is walked at the old speed, for any throttle.
        allowed = stopping_speed(kind, left - state.v * self.dt, self.dt)
        if self.turning:
            return walk(state, self.way.heading, allowed, self.dt)
        too_fast = state.v > allowed - kind.throttle_min * self.dt + 1e-9
        if not too_fast:
            turn = abs(wrap(self.way.heading - state.o))
            self.turning = left >= room_to_turn(kind, turn) + TURN_MARGIN_M
        if self.turning:
            return walk(state, self.way.heading, allowed, self.dt)
        return walk(state, state.o, allowed if too_fast else 0.0, self.dt)
