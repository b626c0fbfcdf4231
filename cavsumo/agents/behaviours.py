"""The programmed behaviour of one body, walking or driving as its start requires.

A behaviour idles until it is begun, is active for a while, and idles again.
"""

from __future__ import annotations

from typing import Protocol

from cavsumo.agents.avoidance import Avoidance
from cavsumo.agents.manoeuvres import Driver, manoeuvre_on
from cavsumo.agents.triggers import Timing, Trigger
from cavsumo.agents.walking import ApproachKerb, CrossingWalk, Stroll
from cavsumo.model.bodies import NOOP, Action
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot


class Behaviour(Protocol):
    """The actions of a programmed body before, while and after it is active."""

    @property
    def active(self) -> bool:
        """Whether the behaviour is under way."""

    def idle(self, snapshot: Snapshot, state: BodyState) -> Action:
        """The next action while it is inactive."""

    def begin(self, state: BodyState) -> bool:
        """Begin now; False if that is impossible."""

    def over(self, state: BodyState) -> bool:
        """The terminator psi: whether the behaviour has reached its end. Changes nothing."""

    def end(self) -> None:
        """Be inactive from now on."""

    def act(self, snapshot: Snapshot, state: BodyState) -> Action:
        """The next action while active and not over."""

    def timing(self, aim: float) -> Trigger:
        """The trigger that begins it as the ego's reaction zone arrives."""


def behaviour(scene: Scene, index: int, idle: str, manoeuvre: str) -> Behaviour:
    """The behaviour of a body, by its start."""
    approach = scene.starts[index].approach
    if approach is None:
        return Walker(scene, index, idle)
    return Driver(scene, index, idle, manoeuvre_on(manoeuvre, approach.type))


class Idle(Protocol):
    """The actions of a pedestrian while its behaviour is inactive."""

    def action(self, state: BodyState) -> Action: ...


class DoNothing:
    """The seed's noop."""

    def action(self, state: BodyState) -> Action:
        return NOOP


def idling(name: str, scene: Scene, index: int) -> Idle:
    """The idle behaviour of that name for a pedestrian."""
    if name == "pavement":
        return Stroll(scene, index)
    if name == "kerb":
        return ApproachKerb(scene, index)
    return DoNothing()


class Walker:
    """Crosses the road, and avoids other bodies before, meanwhile and after."""

    def __init__(self, scene: Scene, index: int, idle: str) -> None:
        self.scene, self.index = scene, index
        self._crossing = CrossingWalk(scene)
        self._idle = idling(idle, scene, index)
        self._avoidance = Avoidance(scene, index)

    @property
    def active(self) -> bool:
        return self._crossing.crossing is not None

    def idle(self, snapshot: Snapshot, state: BodyState) -> Action:
        avoidance = self._avoidance
        if avoidance.tired and isinstance(self._idle, Stroll):
            self._idle.turn_back(state)
            avoidance.turn_back(state)
        action = self._idle.action(state)
        if state.v <= 0.0 and action.throttle <= 0.0 and avoidance.at_rest:
            return action  # it stands and stays: most of the time, at the kerb
        return avoidance.along(snapshot, state, action)

    def begin(self, state: BodyState) -> bool:
        if not self._crossing.begin(state):
            return False
        self._idle = DoNothing()  # beyond the road the data of the start no longer hold
        self._avoidance.rest()
        return True

    def over(self, state: BodyState) -> bool:
        return self._crossing.over(state)

    def end(self) -> None:
        self._crossing.end()

    def act(self, snapshot: Snapshot, state: BodyState) -> Action:
        action, heading = self._crossing.action(state), self._crossing.heading
        return self._avoidance.across(snapshot, state, action, heading)

    def timing(self, aim: float) -> Trigger:
        return Timing(self.scene, self.index, aim)
