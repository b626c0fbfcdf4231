"""The movements of vehicles in a space of tests: their numbers, places and programmes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import compress
from typing import ClassVar

from cavsumo.agents.cues import zone_m
from cavsumo.agents.driving import BRAKING_MPS2
from cavsumo.agents.programmed_manoeuvres import DriveProgramme
from cavsumo.errors import NetworkError
from cavsumo.model.bodies import Kind
from cavsumo.model.carriageway import Approach
from cavsumo.model.geometry import Box, gap
from cavsumo.model.kinematics import wrap
from cavsumo.model.polyline import Path
from cavsumo.network.site import Site
from cavsumo.network.vehicle_starts import APART_M, OnApproach, in_time, lead_range, pace_range
from cavsumo.searchers.places import (
    FROM_LEFT,
    FROM_RIGHT,
    NEAREST_M,
    Place,
    pause_of,
    within,
)

LEADS = 16  # places on an approach: how much earlier than the ego a vehicle arrives
MOST_LEAD_S = 6.0  # one that arrives early waits at its line
SLOWEST_MPS = 1.0
# Where an ego that does not react would be as a vehicle meets it: of one that crosses its way, of
# one that stops in it, of one that first waits for the ego, and of one that is followed by it.
ZONES, STOPPING_ZONES, WAITING_ZONES = (-0.8, 2.0), (-0.8, 4.0), (-0.8, 6.0)
FOLLOWED_ZONES = (0.0, 2.0)  # an ego keeps a distance to a vehicle ahead
DEPTHS_M = (-3.0, 4.0)
THROUGH = 0.6  # share of the number "depth" from which on a vehicle does not stop
ONCOMING_RAD, ALONG_RAD = math.radians(135.0), math.radians(45.0)
AHEAD, BESIDE, ONCOMING, BEHIND = (
    "ahead of the ego", "from the lane beside", "oncoming", "from behind",
)  # fmt: skip


@dataclass(frozen=True)
class Drives:
    """The movements of vehicles at one site (``space.Movements``).

    Attributes:
        ego: its box as it enters.
        start_speed: of all vehicles [m/s]; None leaves it to their numbers.
    """

    kind: Kind
    places: tuple[Place, ...]
    ego: Box
    start_speed: float | None = None

    name: ClassVar[str] = "drives"
    meanings: ClassVar[Mapping[str, str]] = {
        "place": "the approach, and how much earlier than the ego it arrives there",
        "pace": "its speed before the test",
        "zone": "where the ego will be as it begins",
        "speed": "of the first leg",
        "effort": "how hard it accelerates, brakes and turns",
        "depth": "how far in the ego's way it stops, if it stops",
        "resume": "when it goes on",
        "speed_2": "with which it goes on",
    }
    manner: ClassVar[tuple[str, ...]] = ("place", "speed", "depth")

    @property
    def scales(self) -> Mapping[str, tuple[float, float]]:
        """The bounds of the numbers that mean the same on every approach."""
        speeds = SLOWEST_MPS, self.kind.v_max
        return {"speed": speeds, "effort": (0.0, 1.0), "speed_2": speeds}

    def suited(self, shares: Mapping[str, float]) -> tuple[Place, ...]:
        """The places from which the programme of the numbers can be in time; all if none can.

        The vehicle drives up to its line first; the ego is expected to drive at the limit.
        """
        return tuple(compress(self.places, self._in_time(shares))) or self.places

    def _in_time(self, shares: Mapping[str, float]) -> Iterator[bool]:
        """For each place, whether the ego is still to come when a vehicle begins at its line."""
        drive, known = drive_of(shares, self.kind), dict[int, tuple[float, float]]()
        for place in self.places:
            approach = place.start.approach
            assert approach is not None
            if not math.isfinite(approach.wait):
                yield True
                continue
            if id(approach) not in known:  # hundreds of places share a few approaches
                known[id(approach)] = _from_line(approach, drive), _until_cue(approach, drive)
            from_line, until_cue = known[id(approach)]
            way = approach.wait - self._on_approach(place, shares).along
            yield way / min(self.kind.v_max, approach.speed) + from_line <= until_cue

    def realised(self, place: Place, shares: Mapping[str, float]) -> tuple[Place, DriveProgramme]:
        """The place with a start of its own pace, and the programme of the numbers."""
        placed = self._on_approach(place, shares)
        crosses = math.isfinite(placed.approach.wait)
        programme = drive_of(shares, self.kind, crosses=crosses)
        return place._replace(start=placed.start()), programme

    def _on_approach(self, place: Place, shares: Mapping[str, float]) -> OnApproach:
        """The vehicle of a place, with the pace of the numbers."""
        approach = place.start.approach
        assert approach is not None
        pace = within(pace_range(approach), shares["pace"])
        return in_time(approach, self.kind, self.ego.length, pace, place.lead, self.start_speed)

    def fits(self, place: Place, others: Sequence[Place]) -> bool:
        """Whether a body can start at a place, apart from the ego and from others."""
        own = self._box(place)
        taken = (self.ego, *map(self._box, others))
        return all(gap(own, other) > APART_M for other in taken)

    def _box(self, place: Place) -> Box:
        start = place.start
        return Box(start.x, start.y, start.o, self.kind.length, self.kind.width)


def drive_of(shares: Mapping[str, float], kind: Kind, *, crosses: bool = True) -> DriveProgramme:
    """The programme of the numbers of one body, each in [0, 1].

    ``crosses``: it comes across the ego's way or into it, not from ahead or beside.
    """
    pause, resume = pause_of(shares["resume"])
    depth, speeds = shares["depth"], (SLOWEST_MPS, kind.v_max)
    programme = DriveProgramme(
        cue=0.0,
        speed=within(speeds, shares["speed"]),
        effort=shares["effort"],
        depth=None if depth >= THROUGH else within(DEPTHS_M, depth / THROUGH),
        pause=pause,
        resume=resume,
        speed_2=within(speeds, shares["speed_2"]),
    )
    return programme._replace(cue=within(_zones(programme, crosses), shares["zone"]))


def _from_line(approach: Approach, drive: DriveProgramme) -> float:
    """Time from standing at the line until a vehicle comes into the ego's way, roughly [s]."""
    v, way = min(drive.speed, approach.speed), approach.enter - approach.wait
    time = way / v + v / (2.0 * drive.gaining)
    if not drive.hesitates:
        return time
    assert drive.depth is not None
    return (
        time
        + v / (2.0 * BRAKING_MPS2)
        + drive.pause
        + math.sqrt(-2.0 * drive.depth / drive.gaining)
    )


def _until_cue(approach: Approach, drive: DriveProgramme) -> float:
    """Time until the ego, at the limit, is where a vehicle begins [s]."""
    assert not isinstance(drive.cue, str)
    return (approach.ego_enter - zone_m(drive.cue, approach.ego_speed)) / approach.ego_speed


def _zones(programme: DriveProgramme, crosses: bool) -> tuple[float, float]:
    """The zones in which a vehicle may begin."""
    if not crosses:
        return FOLLOWED_ZONES
    if programme.depth is None or programme.hesitates:
        return ZONES
    return STOPPING_ZONES if programme.depth >= 0.0 else WAITING_ZONES


def drives_at(site: Site, kind: Kind, ego: Kind, start_speed: float | None) -> Drives:
    """The movements of vehicles at a site; raises NetworkError where none meets the ego."""
    box = Box(*site.route.path.at(0.0), ego.length, ego.width)
    places = [
        place
        for approach in site.approaches
        for place in _places(approach, site.route.path, kind, box)
    ]
    if not places:
        raise NetworkError(
            f"{site.net}: a search finds no way on which a {kind.name} meets the ego's route "
            f"{NEAREST_M:g} m or more from its beginning; choose another --ego-route"
        )
    places.sort(key=lambda place: (place.whence, place.along))
    return Drives(kind, tuple(places), box, start_speed)


def _places(approach: Approach, ego_path: Path, kind: Kind, ego: Box) -> Iterator[Place]:
    """The places on one approach; none where it meets the ego too early."""
    meets = math.isfinite(approach.wait)
    if meets and approach.ego_enter < NEAREST_M:
        return
    along = approach.ego_enter if meets else 0.0
    pace = sum(pace_range(approach)) / 2
    earliest, latest = lead_range(approach)
    for i in range(LEADS):
        lead = within((earliest, MOST_LEAD_S if meets else latest), i / (LEADS - 1))
        start = in_time(approach, kind, ego.length, pace, lead).start()
        yield Place(start, _whence(approach, ego_path), along, lead)


def _whence(approach: Approach, ego_path: Path) -> str:
    """From where a vehicle on an approach comes, seen from the ego."""
    if not math.isfinite(approach.wait):
        return AHEAD if approach.type == "following" else BESIDE
    turn = wrap(approach.path.at(approach.wait)[2] - ego_path.at(approach.ego_enter)[2])
    if abs(turn) > ONCOMING_RAD:
        return ONCOMING
    if abs(turn) < ALONG_RAD:
        return BEHIND
    return FROM_RIGHT if turn > 0.0 else FROM_LEFT
