"""Vehicles of an exposure: they come to the ego's way and decide once whether to go."""

from __future__ import annotations

import math
from typing import NamedTuple

from cavsumo.agents.drive_programme import AT_LINE_M, ProgrammedDrive
from cavsumo.agents.driving import BRAKING_MPS2, Course
from cavsumo.agents.programmed_manoeuvres import DriveProgramme
from cavsumo.model.bodies import NOOP, Action
from cavsumo.model.kinematics import wrap
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

RED = "r"  # of the ego: then those from the side have green
CREEP_MPS = 1.0  # a slower ego counts as so fast
LIGHT_M = 50.0  # a light of the ego so far before the place where they meet is that of the place
ONCOMING_RAD = math.radians(135.0)  # who has green together with the ego


class ExposedDriver(NamedTuple):
    """A cyclist or driver of an exposure.

    Attributes:
        arrival_s: time that the ego has left, at its present speed, when it would come into the
            ego's way without stopping [s].
        critical_gap_s: smallest time that the ego has left with which it goes, if it looks [s].
        looks: whether it looks.
        complies: whether it waits for a red light.
        programme: how it drives.
    """

    arrival_s: float
    critical_gap_s: float
    looks: bool
    complies: bool
    programme: DriveProgramme


class ExposedDrive(ProgrammedDrive):
    """One vehicle of an exposure, in one episode.

    It stands until it has to depart for its arrival, and decides once, where it must begin to
    brake.
    """

    def __init__(self, scene: Scene, index: int, driver: ExposedDriver | None) -> None:
        super().__init__(scene, index, driver and driver.programme)
        self._exposed, self._departed, self._stays = driver, False, False
        self._late = True  # it never slows down so as to meet the ego
        approach = self._approach
        if driver is not None:
            top = min(approach.speed, driver.programme.speed)
            kind = scene.bodies[index].kind
            self._driver.course = Course(approach.path, kind, scene.dt, top)
        before = [i for i, one in enumerate(scene.lights) if one.along <= approach.ego_enter]
        near = before and approach.ego_enter - scene.lights[before[-1]].along <= LIGHT_M
        self._light = before[-1] if near else None
        turn = approach.path.at(approach.wait)[2] - scene.ego_path.at(approach.ego_enter)[2]
        self._oncoming = abs(wrap(turn)) > ONCOMING_RAD

    def action(self, snapshot: Snapshot, state: BodyState) -> Action:
        """The next action; none before it departs."""
        driver = self._exposed
        if driver is not None and not self._departed:
            self._departed = snapshot.sees_ego and self._departs(snapshot, state, driver)
            if not self._departed:
                return NOOP
        return super().action(snapshot, state)

    def reach(self, snapshot: Snapshot, state: BodyState) -> float:
        """How far it may come [m]; one that stays waits at its line."""
        if self._stays:
            return max(0.0, self._to_line(state)) + AT_LINE_M
        return super().reach(snapshot, state)

    def _departs(self, snapshot: Snapshot, state: BodyState, driver: ExposedDriver) -> bool:
        """Whether it would now arrive as it is drawn, or later."""
        gaining = driver.programme.gaining
        travel, _ = self._driver.course.time_to(state, self._approach.enter, gaining)
        return self._left(snapshot) <= driver.arrival_s + travel

    def _left(self, snapshot: Snapshot) -> float:
        """Time until the ego is where they would meet, at its present speed [s]."""
        front = self.scene.ego_progress(snapshot) + self.scene.ego.kind.length / 2
        return (self._approach.ego_enter - front) / max(CREEP_MPS, snapshot.ego.v)

    def _due(self, snapshot: Snapshot, state: BodyState, programme: DriveProgramme) -> bool:
        """Whether it arrives now and goes."""
        driver = self._exposed
        if driver is None or self._stays or not snapshot.sees_ego:
            return False
        stopping = state.v**2 / (2.0 * BRAKING_MPS2) + state.v * self.scene.dt + AT_LINE_M
        if self._driver.course.place(state)[0] < self._approach.wait - stopping:
            return False
        self._stays = not self._goes(snapshot, driver)
        return not self._stays

    def _goes(self, snapshot: Snapshot, driver: ExposedDriver) -> bool:
        """The decision before the ego's way."""
        letters, light = snapshot.lights, self._light
        if light is not None and light < len(letters) and not self._oncoming:
            if letters[light] == RED:
                return True
            if driver.complies:
                return False
        elif not self._approach.yields:
            return True
        if not driver.looks:
            return True
        left = self._left(snapshot)
        return left < 0.0 or left >= driver.critical_gap_s
