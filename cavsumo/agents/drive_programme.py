"""A vehicle that follows a programme: a manoeuvre of its approach, begun by a cue of the ego.

A programme is a few numbers, so that a search can vary it (``searchers.drives``); their meaning is
in ``programmed_manoeuvres``. Before and after its manoeuvre the vehicle drives lawfully
(``manoeuvres.Driver``).
"""

from __future__ import annotations

import math

from cavsumo.agents.cues import Awaited, EgoReactions, Pause, in_phase, zone_m
from cavsumo.agents.driving import extent, within_turn
from cavsumo.agents.manoeuvres import Driver, EgoPrediction
from cavsumo.agents.programmed_manoeuvres import (
    DriveProgramme,
    Legs,
    ProgrammedRun,
    programmed_manoeuvre,
)
from cavsumo.model.bodies import Action, clamped
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

SIDEWAYS_MPS2 = 5.0  # largest acceleration sideways: half of what dry tyres hold
LATE_S = (
    0.3  # a vehicle that would come so much later than its cue says drives up to the line first
)
AT_LINE_M = 1.0  # a vehicle so near to its line waits there


class ProgrammedDrive:
    """One vehicle that follows its programme, in one episode; without one it drives lawfully."""

    def __init__(self, scene: Scene, index: int, programme: DriveProgramme | None) -> None:
        approach = scene.starts[index].approach
        assert approach is not None
        chosen = programme and programmed_manoeuvre(approach.type, programme)
        self.scene, self.index, self.programme = scene, index, programme
        self._driver = Driver(scene, index, "lawful", chosen)
        self._ego = EgoPrediction(scene, approach.ego_speed)
        self._reactions = EgoReactions()
        self._approach, self._late = approach, False
        if programme is not None:
            self._pause = Pause(programme.pause, programme.resume)
            cue = programme.cue
            self._awaited = Awaited(cue, programme.delay) if isinstance(cue, str) else None

    def reach(self, snapshot: Snapshot, state: BodyState) -> float:
        """How far the vehicle may come from where it is, wherever it drives [m]."""
        return state.body.kind.v_max * max(0.0, self.scene.horizon - snapshot.time)

    def action(self, snapshot: Snapshot, state: BodyState) -> Action:
        """The next action."""
        driver, programme = self._driver, self.programme
        self._reactions.see(snapshot)
        if snapshot.sees_ego:
            self._ego.see(snapshot)
        if programme is None:
            return driver.idle(snapshot, state)
        if driver.active and driver.over(state):
            driver.end()
        due = driver.active or self._due(snapshot, state, programme)
        if not driver.active and not (due and driver.begin(state)):
            return driver.idle(snapshot, state, hurry=self._late)
        legs = driver.manoeuvre
        assert isinstance(legs, Legs)
        stands = legs.stands and not legs.second
        if stands and self._pause.over(
            snapshot, self._reactions, lambda: self._gap(snapshot, state)
        ):
            legs.go_on()
        wanted = driver.act(snapshot, state)
        natural = wanted._replace(throttle=max(-programme.braking, wanted.throttle))
        return within_turn(clamped(natural, state.body.kind), state, SIDEWAYS_MPS2)

    def _due(self, snapshot: Snapshot, state: BodyState, programme: DriveProgramme) -> bool:
        """Whether the vehicle begins now."""
        if not snapshot.sees_ego:
            return False
        if self._awaited is not None:
            return self._awaited.came(self._reactions, snapshot.time)
        assert self._driver.manoeuvre is not None
        assert not isinstance(programme.cue, str)
        meeting = self._driver.manoeuvre.gap(self._ego, state)
        if meeting is None:
            return False
        gap, v = meeting
        most, half = zone_m(programme.cue, v), programme.every / 2
        self._late = gap < most - v * (LATE_S + half) and self._can_hurry(state)
        in_time = gap <= most + v * half and not self._late
        return in_time and in_phase(snapshot.time, programme.phase, programme.every, self.scene.dt)

    def _can_hurry(self, state: BodyState) -> bool:
        """Whether it has not yet come to where it waits, so that it can still gain time."""
        approach = self._approach
        here = self._driver.course.place(state)[0]
        return math.isfinite(approach.wait) and here < approach.wait - AT_LINE_M

    def _gap(self, snapshot: Snapshot, state: BodyState) -> float:
        """The gap that the ego has left as they meet if the vehicle goes on now [m].

        Where it stands in the ego's way, that to the vehicle along the ego's path.
        """
        assert self._driver.manoeuvre is not None
        meeting = self._driver.manoeuvre.gap(self._ego, state)
        if isinstance(self._driver.manoeuvre, ProgrammedRun) and meeting is not None:
            return meeting[0]
        here = self.scene.ego_path.project(state.x, state.y).along
        reach = extent(state, self.scene.ego_path.at(here)[2])[0]
        return here - reach - self.scene.ego.kind.length / 2 - self.scene.ego_progress(snapshot)
