"""A pedestrian's programme: legs across the road, begun by a cue of the ego.

A programme is a few numbers, so that a search can vary it (``searchers.walks``): when the body
steps off, two legs with a pause between them, and the direction in which it leaves. Places and
directions are relative to the ego's path, so a programme makes sense on any road.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from cavsumo.agents.avoidance import Avoidance
from cavsumo.agents.cues import Awaited, Cue, EgoReactions, Pause, in_phase, zone_m
from cavsumo.agents.legs import WalkLeg, walk_time
from cavsumo.agents.planning.coordinates import meeting
from cavsumo.agents.walking import ApproachKerb, stopping_speed, walk
from cavsumo.model.bodies import Action, Kind
from cavsumo.model.kinematics import wrap
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

STOPPED_M = 0.05  # so near to the end of its leg a body has arrived
ROUND_M = 2.0  # that a body's course is longer for turning and stopping
BEYOND_M = 0.6  # so far beyond the edge of the carriageway a body stops


class WalkProgramme(NamedTuple):
    """The programme of one pedestrian.

    Headings are relative to the way straight across [rad]: positive ones turn towards where the ego
    goes, negative ones towards where it comes from.

    Attributes:
        cue: it steps off when an ego that keeps its speed will be in this zone as it enters the
            ego's strip, or after this reaction of the ego (``cues``).
        speed, heading: of the first leg [m/s, rad].
        depth: where the first leg ends: how far the body's front is in the ego's strip, negative
            before it [m].
        pause: how long it then stands at least [s].
        resume: it stands on until this cue; None: no longer.
        speed_2, heading_2, length_2: of the second leg [m/s, rad, m].
        heading_3: of the last one, with the speed of the second, until it has left the road [rad].
        delay: time from a reaction of the ego to the first leg [s].
        every, phase: it steps off at a time that is ``phase`` modulo ``every``, the time between
            two decisions of the ego: at the one nearest to its zone [s]. 0 and 0: at any time.
    """

    cue: Cue
    speed: float
    heading: float
    depth: float
    pause: float
    resume: Cue | None
    speed_2: float
    heading_2: float
    length_2: float
    heading_3: float
    delay: float = 0.0
    every: float = 0.0
    phase: float = 0.0

    @property
    def stops(self) -> bool:
        """Whether the body stands at the end of the first leg."""
        return self.pause > 0.0 or self.resume is not None


class ProgrammedWalk:
    """One pedestrian that follows its programme, in one episode."""

    def __init__(self, scene: Scene, index: int, programme: WalkProgramme | None) -> None:
        self.scene, self.index, self.programme = scene, index, programme
        self._met = meeting(scene, index)
        self._idle = ApproachKerb(scene, index)
        self._avoidance = Avoidance(scene, index)
        self._phase = 0  # before, first leg, pause, second leg, last leg, gone
        self._from = (0.0, 0.0)  # where the second leg began
        self._reactions = EgoReactions()
        if programme is not None:
            cue = programme.cue
            self._awaited = Awaited(cue, programme.delay) if isinstance(cue, str) else None
            self._pause = Pause(programme.pause, programme.resume)
        if self._met is not None:
            _, _, ahead = scene.ego_path.at(self._met.along)
            self._side = math.copysign(1.0, math.sin(ahead - self._met.way.heading))

    def action(self, snapshot: Snapshot, state: BodyState) -> Action:
        """The next action."""
        programme, dt = self.programme, self.scene.dt
        if programme is None or self._met is None:
            return self._avoidance.along(snapshot, state, self._idle.action(state))
        self._reactions.see(snapshot)
        self._advance(snapshot, state, programme)
        if self._phase == 0:
            return self._avoidance.along(snapshot, state, self._idle.action(state))
        heading, speed = self._course(state, programme)
        if self._phase == 1 and programme.stops:
            speed = min(speed, stopping_speed(state.body.kind, self._to_go(state, programme), dt))
        wanted = walk(state, heading, speed, dt)
        return self._avoidance.across(snapshot, state, wanted, heading)

    def reach(self, snapshot: Snapshot, state: BodyState) -> float:
        """How far the body may come from where it is, detours around others apart [m]."""
        if self.programme is None or self._met is None:
            return ROUND_M + self._idle.left(state)
        way, programme = self._met.way, self.programme
        across = way.leave - way.enter + 2.0 * BEYOND_M
        legs = (
            (1, across / math.cos(programme.heading)),
            (3, programme.length_2),
            (4, across / max(1e-9, abs(math.cos(programme.heading_3)))),
        )
        ahead = sum(length for phase, length in legs if self._phase <= phase)
        kind, left = state.body.kind, max(0.0, self.scene.horizon - snapshot.time)
        return ROUND_M + min(ahead, kind.v_max * left)

    def _course(self, state: BodyState, programme: WalkProgramme) -> tuple[float, float]:
        """The heading [rad] and the speed [m/s] of the present phase."""
        turn, speed = (
            (0.0, 0.0),
            (programme.heading, programme.speed),
            (programme.heading, 0.0),
            (programme.heading_2, programme.speed_2),
            (programme.heading_3, programme.speed_2),
            (programme.heading_3, 0.0),
        )[self._phase]
        return self._heading(turn) if speed > 0.0 else state.o, speed

    def _heading(self, turn: float) -> float:
        """A heading relative to the way across, as a heading [rad]."""
        assert self._met is not None
        return wrap(self._met.way.heading + self._side * turn)

    def _advance(self, snapshot: Snapshot, state: BodyState, programme: WalkProgramme) -> None:
        """Go on to the phase that begins now, if any."""
        assert self._met is not None
        if self._phase == 0 and self._due(snapshot, state, programme):
            self._phase = 1
        if self._phase == 1 and self._to_go(state, programme) <= STOPPED_M * programme.stops:
            self._phase = 2
        if self._phase == 2 and self._pause.over(
            snapshot, self._reactions, lambda: self._gap_at_entry(snapshot, state, programme)
        ):
            self._phase, self._from = 3, (state.x, state.y)
        if self._phase == 3 and math.dist(self._from, (state.x, state.y)) >= programme.length_2:
            self._phase = 4
        if 1 <= self._phase <= 4 and self._off(state):
            self._phase = 5

    def _to_go(self, state: BodyState, programme: WalkProgramme) -> float:
        """How far the first leg still leads [m]."""
        assert self._met is not None
        front = self._met.way.progress(state.x, state.y) - self._met.strip
        return (programme.depth - front) / math.cos(programme.heading)

    def _off(self, state: BodyState) -> bool:
        """Whether the body has left the road, on either side."""
        assert self._met is not None
        way = self._met.way
        there = way.progress(state.x, state.y)
        back = self._phase >= 3 and there < way.enter - BEYOND_M
        return back or there > way.leave + BEYOND_M

    def _due(self, snapshot: Snapshot, state: BodyState, programme: WalkProgramme) -> bool:
        """Whether the body steps off now."""
        if not snapshot.sees_ego:
            return False
        if self._awaited is not None:
            return self._awaited.came(self._reactions, snapshot.time)
        met = self._met
        assert met is not None
        assert not isinstance(programme.cue, str)
        left = max(0.0, met.strip - met.way.progress(state.x, state.y))
        entry, shift = entry_of(programme, left, state.body.kind)
        v = snapshot.ego.v
        gap = self._gap(snapshot, shift) - v * (entry + self.scene.dt)
        return gap <= zone_m(programme.cue, v) + v * programme.every / 2 and in_phase(
            snapshot.time, programme.phase, programme.every, self.scene.dt
        )

    def _gap_at_entry(
        self, snapshot: Snapshot, state: BodyState, programme: WalkProgramme
    ) -> float:
        """The gap that the ego has left as the last legs enter its strip [m]."""
        met = self._met
        assert met is not None
        along = self.scene.ego_path.project(state.x, state.y).along
        left = max(0.0, met.strip - met.way.progress(state.x, state.y))
        entry, shift = walk_time(_last_legs(programme), left, state.body.kind) or (0.0, 0.0)
        return self._gap(snapshot, along - met.along + shift) - snapshot.ego.v * entry

    def _gap(self, snapshot: Snapshot, shift: float) -> float:
        """Distance from the ego's front to the body, so far beyond its meeting point [m]."""
        assert self._met is not None
        half = self.scene.ego.kind.length / 2 + self.scene.bodies[self.index].kind.width / 2
        return self._met.along + shift - half - self.scene.ego_progress(snapshot)


def entry_of(programme: WalkProgramme, left: float, kind: Kind) -> tuple[float, float]:
    """When a body so far from the ego's strip would enter it by its programme, and where [s, m].

    The place is relative to where it would enter straight across, along the ego's path. A body that
    waits for the ego before the strip, or never enters it, counts as if its first leg went on.
    """
    first = WalkLeg(programme.speed, programme.heading, math.inf)
    if programme.depth < 0.0 and programme.resume is None:
        to_go = max(0.0, left + programme.depth)
        short = first._replace(length=to_go / math.cos(programme.heading), stops=programme.stops)
        entered = walk_time([short, *_last_legs(programme)], left, kind)
        if entered is not None:
            return programme.pause + entered[0], entered[1]
    return walk_time([first], left, kind) or (0.0, 0.0)


def _last_legs(programme: WalkProgramme) -> list[WalkLeg]:
    """The legs after the pause."""
    second = WalkLeg(programme.speed_2, programme.heading_2, programme.length_2)
    return [second, WalkLeg(programme.speed_2, programme.heading_3, math.inf)]
