"""A test in coordinates relative to the ego's path, so that it can be played on another network.

A test that a search chose is a programme already (``agents.programme``). The track of a pedestrian
that another agent moved is fitted to one, with W the width of the strip that the ego sweeps for
the pedestrian's middle, and k the timestep before it moves:

* the zone: where an ego that keeps its speed would be as the pedestrian enters the strip, with the
  speed that it had before it braked for it;
* the first leg: median speed, and the direction from the first moving place to the strip;
* a pause, where it stands again, and a second leg from there to the violation. One that stands
  before the strip goes on when the ego is in the same zone.

The moment of entering the strip, modulo the time between two decisions of the ego, is the phase.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cavsumo.agents.cues import zone_m
from cavsumo.agents.names import SEARCH
from cavsumo.agents.programme import WalkProgramme, entry_of
from cavsumo.agents.programmed_manoeuvres import DriveProgramme
from cavsumo.agents.searched import Programme, programme_of
from cavsumo.agents.triggers import REACTION_TIME
from cavsumo.batch.playback import for_playback
from cavsumo.batch.prepared import prepare
from cavsumo.batch.replay import Record
from cavsumo.egos.specs import ego_of
from cavsumo.errors import InputError
from cavsumo.kept.transfer_order import PHASE, ZONE
from cavsumo.model.bodies import WALKING, Kind, kind_named
from cavsumo.model.kinematics import wrap
from cavsumo.model.polyline import Path
from cavsumo.results.rows import is_failure
from cavsumo.searchers.places import FROM_LEFT, FROM_RIGHT, Place
from cavsumo.searchers.space import Space

STOOD_MPS = 0.05  # slower than this a body stands
PAUSE_S = 0.3  # a shorter stop is none
SLOWEST_EGO_MPS = 0.5  # of an ego that is slower nothing can be foreseen
SAME_START_M = 0.01  # between a recorded start and a place of the space


@dataclass(frozen=True)
class RelativeTest:
    """A test in coordinates relative to the ego's path.

    Attributes:
        name: as the user named it.
        record: the episode.
        kind: of the body that the ego hits.
        programme: what that does.
        whence: from where it comes, seen from the ego (``searchers.places``).
        lead: how much earlier than the ego a vehicle arrives, or how far it is ahead [s].
        enters: when a pedestrian entered the ego's strip; None for vehicles [s].
        every: time between two decisions of the ego; 0 if it decides in every timestep [s].
    """

    name: str
    record: Record
    kind: Kind
    programme: Programme
    whence: str
    lead: float = 0.0
    enters: float | None = None
    every: float = 0.0

    def at(self, place: Place) -> dict[str, Programme]:
        """The programmes at a place, by form: in its zone, and in its phase if it has one.

        A zone is met exactly at any time. A phase is met exactly in the timestep nearest to the
        zone; where the ego is then may differ by half the way that it drives between two decisions.
        """
        walk = self.programme
        if not isinstance(walk, WalkProgramme) or self.enters is None or not self.every:
            return {ZONE: walk}
        entry, _ = entry_of(walk, place.away, self.kind)
        phase = (self.enters - entry) % self.every
        return {
            ZONE: walk._replace(every=0.0, phase=0.0),
            PHASE: walk._replace(every=self.every, phase=phase),
        }


def relative_test(name: str, record: Record) -> RelativeTest:
    """The relative form of a recorded failure; raises InputError where it has none.

    ``name``: as the user named it.
    """
    scenario, row = record.plan.scenario, record.row
    if scenario.script is not None:
        raise InputError(f"{name}: is a scripted test, which suites play; it is not transferred")
    if not is_failure(row) or not row["tester"].startswith("tester"):
        raise InputError(f"{name}: is {row['outcome']}, expected a test that a tester fails")
    if record.trace is None:
        raise InputError(f"{name}: no trace was kept of it")
    body = int(row["tester"].removeprefix("tester"))
    kind = kind_named(scenario.kind)
    home = prepare(for_playback(record).plan).space
    programme = _searched(record, body)
    every = home.every
    if programme is not None:
        place = _place_of(record, body, home)
        if place is not None:
            return _known(name, record, kind, programme, place, every)
    if kind.name not in WALKING:
        raise InputError(
            f"{name}: the vehicle that the ego hits was not moved by agent {SEARCH}, and its track "
            "follows the lanes of its own network: only programmes of a search have a relative form"
        )
    track = WalkedTrack.of(record, row["tester"], home.site.route.path, kind)
    walk = track.programme(name)
    whence = FROM_LEFT if track.left else FROM_RIGHT
    enters = track.enters * scenario.step_length
    return RelativeTest(name, record, kind, walk, whence, enters=enters, every=every)


def _searched(record: Record, body: int) -> Programme | None:
    """The programme that a search chose for a body; None of another agent, or of decisions."""
    assert record.trace is not None
    if record.plan.cast.get(record.row["agent"]) != SEARCH:
        return None
    told: list[Mapping[str, Any]] = [
        one for memory in record.trace.head.get("memory") or () for one in memory["programmes"]
    ]
    if body >= len(told) or told[body] is None or "chosen" in told[body]:
        return None
    return programme_of(told[body])


def _place_of(record: Record, body: int, home: Space) -> Place | None:
    """The place of the space at which a body started."""
    assert record.trace is not None
    x, y = record.trace.recording().starts[body][:2]
    near = min(home.movements.places, key=lambda p: math.dist((x, y), (p.start.x, p.start.y)))
    vehicle = near.start.approach is not None
    apart = math.dist((x, y), (near.start.x, near.start.y))
    return near if vehicle or apart < SAME_START_M else None


def _known(
    name: str, record: Record, kind: Kind, programme: Programme, place: Place, every: float
) -> RelativeTest:
    """The relative form of a test of a search."""
    enters = None
    if isinstance(programme, WalkProgramme) and programme.every:
        enters = programme.phase + entry_of(programme, place.away, kind)[0]
    form = RelativeTest(name, record, kind, programme, place.whence, place.lead, enters, every)
    assert isinstance(programme, WalkProgramme | DriveProgramme)
    return form


@dataclass(frozen=True)
class WalkedTrack:
    """The track of a pedestrian up to the violation, seen from the ego's path.

    Attributes:
        poses: x, y [m], v [m/s], o [rad] in each timestep.
        egos: those of the ego.
        path: of the ego.
        strip: half the width of the strip in which the ego touches the pedestrian's middle [m].
        reach: from the ego's middle to where its front touches the pedestrian's side [m].
        dt: length of a timestep [s].
    """

    poses: Sequence[Sequence[float]]
    egos: Sequence[Sequence[float]]
    path: Path
    strip: float
    reach: float
    dt: float

    @classmethod
    def of(cls, record: Record, tester: str, path: Path, kind: Kind) -> WalkedTrack:
        """The track of a tester of a record."""
        assert record.trace is not None
        dt, ego = record.plan.scenario.step_length, ego_of(record.plan.scenario).kind
        end = round(float(record.row["violation_time_s"]) / dt)
        frames = record.trace.frames[: end + 1]
        return cls(
            [frame["testers"][tester] for frame in frames],
            [frame["ego"] for frame in frames],
            path,
            (ego.width + kind.length) / 2,
            (ego.length + kind.width) / 2,
            dt,
        )

    def lateral(self, i: int) -> float:
        """Where it is beside the path, positive to the left [m]."""
        x, y = self.poses[i][:2]
        return self.path.project(x, y).lateral

    def _along(self, pose: Sequence[float]) -> float:
        """How far along the path a pose is [m]."""
        return self.path.project(pose[0], pose[1]).along

    @property
    def left(self) -> bool:
        """Whether it comes from the left."""
        return self.lateral(0) > 0.0

    @property
    def begins(self) -> int:
        """The last timestep before it moves."""
        moving = (i for i, pose in enumerate(self.poses) if pose[2] > STOOD_MPS)
        return max(0, next(moving, 0) - 1)

    @property
    def enters(self) -> int:
        """The timestep in which it enters the strip; the last one if it never does."""
        last = len(self.poses) - 1
        inside = (i for i in range(self.begins, last) if abs(self.lateral(i)) <= self.strip)
        return next(inside, last)

    def programme(self, name: str) -> WalkProgramme:
        """The programme that it is fitted to; InputError where there is none."""
        k, e, last = self.begins, self.enters, len(self.poses) - 1
        if abs(self.lateral(0)) <= self.strip or e <= k:
            raise InputError(f"{name}: the pedestrian begins in the ego's way")
        if max(ego[2] for ego in self.egos[k : e + 1]) < SLOWEST_EGO_MPS:
            raise InputError(f"{name}: the ego stands as the pedestrian sets off")
        stop, on = self._pause(k)
        waits = stop < e  # it stands before the strip until the ego comes
        second = on if on < last else k
        straight = self._turn(second, last)
        first = self._turn(k, min(e, stop))
        return WalkProgramme(
            cue=self._zone(k, min(e, stop) if waits else e),
            speed=self._speed(k, stop),
            heading=first,
            depth=self._depth(stop),
            pause=0.0 if waits else (on - stop) * self.dt,
            resume=self._zone(on, e) if waits else None,
            speed_2=self._speed(second, last),
            heading_2=straight,
            length_2=math.dist(self.poses[second][:2], self.poses[last][:2]),
            heading_3=straight,
        )

    def _zone(self, first: int, enters: int) -> float:
        """The zone of an ego that keeps its speed, as the body comes where it is at ``enters``.

        That of its highest speed since the timestep ``first``: before it brakes for the body, if it
        does, and after it gained speed.
        """
        i = max(range(first, enters + 1), key=lambda n: (self.egos[n][2], n))
        v = max(self.egos[i][2], SLOWEST_EGO_MPS)
        meets = self._along(self.poses[enters]) - self._along(self.egos[i]) - self.reach
        gap = meets - v * (enters - i) * self.dt
        return (gap - zone_m(0.0, v)) / (REACTION_TIME * v)

    def _depth(self, stop: int) -> float:
        """How far its front is in the strip as it stops; beyond the strip if it does not [m]."""
        if stop == len(self.poses) - 1:
            return 2.0 * self.strip
        beside = self.lateral(stop) * (1.0 if self.left else -1.0)
        return min(self.strip - beside, 2.0 * self.strip)

    def _pause(self, begins: int) -> tuple[int, int]:
        """From when until when it stands after its first leg; the last timestep for never."""
        last = len(self.poses) - 1
        least = math.ceil(PAUSE_S / self.dt)
        for i in range(begins + 2, last - least + 1):
            if all(pose[2] <= STOOD_MPS for pose in self.poses[i : i + least]):
                on = (j for j in range(i, last) if self.poses[j][2] > STOOD_MPS)
                return i, next(on, last)
        return last, last

    def _speed(self, first: int, last: int) -> float:
        """The median speed of the moving part [m/s]."""
        speeds = [self.poses[i][2] for i in range(first, last + 1)]
        fast = [v for v in speeds if v > max(speeds) / 2]
        return statistics.median(fast) if fast else 0.0

    def _turn(self, first: int, last: int) -> float:
        """A direction relative to straight across, positive towards where the ego goes [rad]."""
        (x, y), (x1, y1) = self.poses[first][:2], self.poses[last][:2]
        ahead = self.path.at(self.path.project(x1, y1).along)[2]
        across = ahead - math.pi / 2 if self.left else ahead + math.pi / 2
        side = 1.0 if self.left else -1.0
        return side * wrap(math.atan2(y1 - y, x1 - x) - across)
