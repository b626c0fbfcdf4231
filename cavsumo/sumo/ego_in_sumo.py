"""The ego in SUMO: commanded, or left to the drivers of SUMO, and read in every timestep."""

from __future__ import annotations

import math

import libsumo

from cavsumo.egos.base import Acceleration, Command, Drive
from cavsumo.errors import EgoError, NoSuchAction
from cavsumo.model.bodies import Body
from cavsumo.model.kinematics import steering_for_turn, step_floats, wrap
from cavsumo.model.snapshot import BodyState
from cavsumo.sumo.calls import direct
from cavsumo.sumo.guided import GuidedEgo
from cavsumo.sumo.moved_bodies import EGO, UNSAFE, MovedBodies
from cavsumo.sumo.poses import from_sumo


class EgoInSumo:
    """The ego of one episode.

    Args:
        body: its id and its box.
        moved: by which an ego that steers itself is moved.
        dt: length of a timestep [s].
        guided: the ego of a scripted test; None for others.

    Attributes:
        state: its state now; set with ``found`` before the first command.
        steering: its steering angle in the last timestep [rad].
    """

    state: BodyState

    def __init__(
        self, body: Body, moved: MovedBodies, dt: float, guided: GuidedEgo | None = None
    ) -> None:
        self._body, self._moved, self._dt, self._guided = body, moved, dt, guided
        self._driven: BodyState | None = None
        self._commanded = False
        self.steering = 0.0
        self._ids = direct(libsumo.vehicle, "getIDList")
        self._position = direct(libsumo.vehicle, "getPosition")
        self._angle = direct(libsumo.vehicle, "getAngle")
        self._speed = direct(libsumo.vehicle, "getSpeed")

    def command(self, command: Command) -> None:
        """Pass on the ego's command; None leaves the ego to SUMO.

        Raises EgoError for one that steers no longer itself.
        """
        if command is None:
            if self._guided is not None:
                self._guided.release()
            return
        if not self._commanded:  # its first command may come late, when another driver takes over
            self._commanded = True
            libsumo.vehicle.setSpeedMode(EGO, UNSAFE)
        ego, kind = self.state, self._body.kind
        if isinstance(command, Acceleration):
            if self._driven is not None:
                raise EgoError("an ego that steers itself cannot be handed to one that does not")
            if self._guided is not None and self._guided.held():
                return
            v = min(kind.v_max, max(kind.v_min, ego.v + command.value * self._dt))
            libsumo.vehicle.setSpeed(EGO, v)
        elif isinstance(command, Drive):
            limits = kind.wheelbase, kind.v_min, kind.v_max, self._dt
            self._driven = BodyState(self._body, *step_floats(*ego[1:], *command, *limits))
            self.steering = command.steering
            self._moved.place([self._driven])

    def follow(self, vehicles: tuple[str, ...]) -> BodyState | None:
        """The ego after a timestep of SUMO; None when it has left the network.

        ``vehicles``: the ids of all in SUMO.
        """
        if self._driven is not None:
            self.state = self._driven
            return self._driven
        found = self.found(vehicles)
        if found is None:
            return None
        self.steering = self._implied_steering(found)
        self.state = found
        return found

    def found(self, vehicles: tuple[str, ...]) -> BodyState | None:
        """The ego as SUMO moves it; None before it entered and after it left."""
        if EGO not in vehicles:
            return None
        if self._guided is not None:
            return self._guided.state()
        x, y = self._position(EGO)
        x, y, o = from_sumo(x, y, self._angle(EGO), self._body.kind.length)
        return BodyState(self._body, x, y, self._speed(EGO), o)

    def _implied_steering(self, ego: BodyState) -> float:
        """The steering angle that the ego's last turn implies (seed, eq. 22), within its limits.

        SUMO turns a vehicle as its lane bends, also more sharply than its axles could.
        """
        kind, before = ego.body.kind, self.state
        if ego.o == before.o:
            return 0.0
        turn = wrap(ego.o - before.o)
        try:
            steering = steering_for_turn(ego.v, turn, kind.wheelbase, self._dt) if turn else 0.0
        except NoSuchAction:
            return math.copysign(kind.steering_max, turn) if ego.v > 0 else 0.0
        return min(kind.steering_max, max(-kind.steering_max, steering))
