"""A vehicle that follows a programme: a manoeuvre of its approach, begun by a cue of the ego.

A programme is a few numbers, so that a search can vary it (``searchers.drives``); their meaning is
in ``programmed_manoeuvres``. Before and after its manoeuvre the vehicle drives lawfully
(``manoeuvres.Driver``). One that crosses the ego's way is on its way to it for seconds, in which
the ego's speed changes; so until it has to brake for its line it keeps to its time, and only then
has it begun.
"""

from __future__ import annotations

import math

from cavsumo.agents.cues import Awaited, EgoReactions, Pause, in_phase, zone_m
from cavsumo.agents.driving import BRAKING_MPS2, extent, within_turn
from cavsumo.agents.manoeuvres import Driver, EgoPrediction
from cavsumo.agents.programmed_manoeuvres import (
    DriveProgramme,
    Followed,
    Legs,
    ProgrammedRun,
    programmed_manoeuvre,
)
from cavsumo.agents.red_lights import holds, red_along
from cavsumo.model.bodies import SIDEWAYS_MPS2, Action, clamped
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

LATE_S = (
    0.3  # a vehicle that would come so much later than its cue says drives up to the line first
)
EARLY_S = 0.5  # one that would come earlier by no more than this does not stop at its line
AT_LINE_M = 1.0  # a vehicle so near to its line waits there
SLOWEST_MPS = 1.0  # a slower ego counts as so fast
EASING_MPS2 = 1.0  # brake of one that would come too early, far from its line
KEPT = 0.75  # a moment stays chosen until it is this share of the interval of decisions off


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
        self._approach, self._late, self._under_way = approach, False, False
        self._chosen = math.inf  # when it is to come into the ego's way
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
        if not driver.active:
            waits = self._before(snapshot, state, programme)
            if waits is not None:
                return waits
        legs = driver.manoeuvre
        assert isinstance(legs, Legs)
        stands = legs.stands and not legs.second
        if stands and self._pause.over(
            snapshot, self._reactions, lambda: self._gap(snapshot, state)
        ):
            legs.go_on()
        return self._natural(driver.act(snapshot, state), state, programme)

    def _natural(self, wanted: Action, state: BodyState, programme: DriveProgramme) -> Action:
        """An action within the limits of the programme and of tyres."""
        natural = wanted._replace(throttle=max(-programme.braking, wanted.throttle))
        return within_turn(clamped(natural, state.body.kind), state, SIDEWAYS_MPS2)

    def _before(
        self, snapshot: Snapshot, state: BodyState, programme: DriveProgramme
    ) -> Action | None:
        """The action of a vehicle whose manoeuvre has not begun; None where it begins now."""
        driver = self._driver
        if not driver.can_begin(state):
            return driver.idle(snapshot, state)
        if self._due(snapshot, state, programme):
            if self._awaited is not None or self._committed(state):
                driver.begin(state)
                return None
            self._under_way = True
            return self._natural(driver.act(snapshot, state), state, programme)
        idle = driver.idle(snapshot, state, hurry=self._late)
        if self._under_way and self._to_line(state) > state.v * state.v / (2.0 * EASING_MPS2):
            return idle._replace(throttle=max(-EASING_MPS2, idle.throttle))
        return idle

    def _committed(self, state: BodyState) -> bool:
        """Whether it would have to brake for its line now; always where it need not wait."""
        return self._to_line(state) <= AT_LINE_M + state.v * state.v / (2.0 * BRAKING_MPS2)

    def _to_line(self, state: BodyState) -> float:
        """How far it still is to its line, or to where it stops before that [m]."""
        approach, programme = self._approach, self.programme
        if not math.isfinite(approach.wait):
            return -math.inf
        assert programme is not None
        stop = math.inf if programme.depth is None else approach.enter + programme.depth
        return min(approach.wait, stop) - self._driver.course.place(state)[0]

    def _due(self, snapshot: Snapshot, state: BodyState, programme: DriveProgramme) -> bool:
        """Whether it is time for the manoeuvre."""
        if not snapshot.sees_ego or self._ego_waits(snapshot):
            return False
        if self._awaited is not None:
            return self._awaited.came(self._reactions, snapshot.time)
        manoeuvre, cue = self._driver.manoeuvre, programme.cue
        assert manoeuvre is not None
        assert not isinstance(cue, str)
        meeting = manoeuvre.gap(self._ego, state)
        if meeting is None:
            return False
        gap, v = meeting
        spare = (gap - zone_m(cue, v)) / max(SLOWEST_MPS, v)
        dt, every, now = self.scene.dt, programme.every, snapshot.time
        if not isinstance(manoeuvre, ProgrammedRun):
            assert isinstance(manoeuvre, Followed)
            close = spare <= every / 2 or manoeuvre.followed(self._ego, state, gap)
            return close and in_phase(now, programme.phase, every, dt)
        arrives = now + manoeuvre.arrival(state)[0]
        spare = self._moment(arrives + spare, programme) - arrives
        self._late = spare < -LATE_S and not self._under_way and self._can_hurry(state)
        # To stop at the line costs more time than that, and it is only foreseen.
        most = EARLY_S if self._under_way and self._committed(state) else dt / 2
        return spare <= most and not self._late

    def _ego_waits(self, snapshot: Snapshot) -> bool:
        """Whether the ego stops at a red light before they would meet, or will."""
        if not self.scene.lights or not math.isfinite(self._approach.wait):
            return False
        line = red_along(self.scene, snapshot, self._ego.front)
        return line < self._approach.ego_enter and holds(line, self._ego.front, self._ego.v)

    def _moment(self, time: float, programme: DriveProgramme) -> float:
        """The moment with the programme's phase that is nearest to a time, or was so before [s]."""
        every, phase = programme.every, programme.phase
        if every <= self.scene.dt:
            return time
        if abs(self._chosen - time) > KEPT * every:
            self._chosen = phase + every * round((time - phase) / every)
        return self._chosen

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
