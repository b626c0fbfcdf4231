"""A pedestrian's programme: legs across the road, begun as the ego comes to a certain place.

A programme is a few numbers, so that a search can vary it (``searchers.space``): when the body
steps off, two legs with a pause between them, and the direction in which it leaves. Places and
directions are relative to the ego's path, so a programme makes sense on any road.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from cavsumo.agents.avoidance import Avoidance
from cavsumo.agents.planning.coordinates import meeting
from cavsumo.agents.triggers import MAX_DECEL, REACTION_TIME
from cavsumo.agents.walking import ApproachKerb, stopping_speed, walk
from cavsumo.model.bodies import Action, Kind
from cavsumo.model.kinematics import wrap
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

LONGEST_WAIT_S = 8.0  # a body that waits for the ego on the road goes on after this time
STOPPED_M = 0.05  # so near to the end of its leg a body has arrived
BEYOND_M = 0.6  # so far beyond the edge of the carriageway a body stops


class WalkProgramme(NamedTuple):
    """The programme of one pedestrian.

    Headings are relative to the way straight across [rad]: positive ones turn towards where the ego
    goes, negative ones towards where it comes from.

    Attributes:
        zone: it steps off when an ego that keeps its speed will have this gap left to it as it
            enters the ego's strip: 0 is the ego's braking distance, 1 that and the way of its
            reaction time (``triggers``).
        speed, heading: of the first leg [m/s, rad].
        depth: where the first leg ends: how far the body's front is in the ego's strip, negative
            before it [m].
        pause: how long it then stands [s].
        resume: it stands on until the gap to the ego is in this zone; None: after the pause.
        speed_2, heading_2, length_2: of the second leg [m/s, rad, m].
        heading_3: of the last one, with the speed of the second, until it has left the road [rad].
    """

    zone: float
    speed: float
    heading: float
    depth: float
    pause: float
    resume: float | None
    speed_2: float
    heading_2: float
    length_2: float
    heading_3: float

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
        self._since = 0.0  # when the pause began [s]
        self._from = (0.0, 0.0)  # where the second leg began
        if self._met is not None:
            _, _, ahead = scene.ego_path.at(self._met.along)
            self._side = math.copysign(1.0, math.sin(ahead - self._met.way.heading))

    def action(self, snapshot: Snapshot, state: BodyState) -> Action:
        """The next action."""
        programme, dt = self.programme, self.scene.dt
        if programme is None or self._met is None:
            return self._avoidance.along(snapshot, state, self._idle.action(state))
        self._advance(snapshot, state, programme)
        if self._phase == 0:
            return self._avoidance.along(snapshot, state, self._idle.action(state))
        heading, speed = self._course(state, programme)
        if self._phase == 1 and programme.stops:
            speed = min(speed, stopping_speed(state.body.kind, self._to_go(state, programme), dt))
        wanted = walk(state, heading, speed, dt)
        return self._avoidance.across(snapshot, state, wanted, heading)

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
            self._phase, self._since = 2, snapshot.time
        if self._phase == 2 and self._goes_on(snapshot, state, programme):
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
        assert self._met is not None
        met = self._met
        left = max(0.0, met.strip - met.way.progress(state.x, state.y))
        entry, shift = _entry(programme, left, state.body.kind)
        return self._gap(snapshot, shift) - snapshot.ego.v * (entry + self.scene.dt) <= _zone_m(
            programme.zone, snapshot.ego.v
        )

    def _goes_on(self, snapshot: Snapshot, state: BodyState, programme: WalkProgramme) -> bool:
        """Whether the pause is over."""
        waited = snapshot.time - self._since
        if waited < programme.pause - 1e-9:
            return False
        if programme.resume is None or waited >= LONGEST_WAIT_S:
            return True
        met = self._met
        assert met is not None
        v, along = snapshot.ego.v, self.scene.ego_path.project(state.x, state.y).along
        left = max(0.0, met.strip - met.way.progress(state.x, state.y))
        entry, shift = _walked(_last_legs(programme), left, state.body.kind) or (0.0, 0.0)
        gap = self._gap(snapshot, along - met.along + shift) - v * entry
        return gap <= _zone_m(programme.resume, v)

    def _gap(self, snapshot: Snapshot, shift: float) -> float:
        """Distance from the ego's front to the body, so far beyond its meeting point [m]."""
        assert self._met is not None
        half = self.scene.ego.kind.length / 2 + self.scene.bodies[self.index].kind.width / 2
        return self._met.along + shift - half - self.scene.ego_progress(snapshot)


class _Leg(NamedTuple):
    """A straight leg: its speed [m/s], heading [rad], length [m], and whether it ends at rest."""

    speed: float
    heading: float
    length: float
    stops: bool = False


def _entry(programme: WalkProgramme, left: float, kind: Kind) -> tuple[float, float]:
    """When a body so far from the ego's strip would enter it by its programme, and where [s, m].

    The place is relative to where it would enter straight across, along the ego's path. A body that
    waits for the ego before the strip, or never enters it, counts as if its first leg went on.
    """
    first = _Leg(programme.speed, programme.heading, math.inf)
    if programme.depth < 0.0 and programme.resume is None:
        to_go = max(0.0, left + programme.depth)
        short = first._replace(length=to_go / math.cos(programme.heading), stops=programme.stops)
        walked = _walked([short, *_last_legs(programme)], left, kind)
        if walked is not None:
            return programme.pause + walked[0], walked[1]
    return _walked([first], left, kind) or (0.0, 0.0)


def _last_legs(programme: WalkProgramme) -> list[_Leg]:
    """The legs after the pause."""
    second = _Leg(programme.speed_2, programme.heading_2, programme.length_2)
    return [second, _Leg(programme.speed_2, programme.heading_3, math.inf)]


def _walked(legs: Sequence[_Leg], left: float, kind: Kind) -> tuple[float, float] | None:
    """Time until so much of the way across is behind, and the way along meanwhile [s, m].

    The body begins at rest, and brakes as hard as it gains speed; None if it never gets there.
    """
    time = shift = v = 0.0
    for leg in legs:
        towards = math.cos(leg.heading)
        if towards > 1e-3 and leg.length * towards >= left:
            way = left / towards
            return time + _spent(way, v, leg.speed, kind), shift + way * math.sin(leg.heading)
        if not math.isfinite(leg.length):
            return None
        left -= leg.length * towards
        shift += leg.length * math.sin(leg.heading)
        speed = (
            min(leg.speed, math.sqrt(leg.length * kind.throttle_max)) if leg.stops else leg.speed
        )
        time += _spent(leg.length, v, speed, kind) if speed > 0.0 else 0.0
        time += leg.stops * speed / (2.0 * kind.throttle_max)
        v = 0.0 if leg.stops else speed
    return None


def _spent(way: float, v: float, speed: float, kind: Kind) -> float:
    """Time to walk so far from one speed to another one [s]."""
    a = math.copysign(kind.throttle_max, speed - v)
    changing = (speed - v) * (speed + v) / (2.0 * a)
    if changing >= way:
        return (math.sqrt(max(0.0, v * v + 2.0 * a * way)) - v) / a
    return (speed - v) / a + (way - changing) / speed


def _zone_m(zone: float, v: float) -> float:
    """A zone as a distance ahead of an ego of a speed [m]."""
    return 0.5 * v * v / MAX_DECEL + zone * REACTION_TIME * v
