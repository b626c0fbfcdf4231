"""The space of tests with pedestrians: a point of the unit cube is starts and programmes.

Every body has a place along the ego's path, from the left or from the right, and a programme
(``agents.programme``); each further body also takes part or stands by.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cavsumo.agents.programme import WalkProgramme
from cavsumo.agents.recorded import Teams
from cavsumo.errors import NetworkError
from cavsumo.model.bodies import Kind
from cavsumo.model.carriageway import Start
from cavsumo.network.pedestrian_starts import APART_M
from cavsumo.network.recorded_starts import start_record
from cavsumo.network.site import Site

Point = NDArray[np.float64]  # shape (dimension,), each number in [0, 1]

STRETCH_M = 20.0  # length of a cell along the ego's path
PLACE_M = 0.5  # distance of two places along a pavement
NEAREST_M = 12.0  # nearer to where the ego enters nobody can meet it in time
SLOWEST_MPS = 0.3
OBLIQUE_RAD = math.radians(60.0)  # of the first leg, to either side
ZONES = (-0.8, 1.6)  # where an ego that does not react would be as a body comes into its way
RESUMED = (-0.5, 2.5)  # where it is as a body goes on
DEPTHS_M = (-1.5, 3.0)
LONGEST_PAUSE_S = 2.0
LONGEST_M = 5.0  # of the second leg
NAMES = (
    "place", "zone", "speed", "heading", "depth", "resume", "speed_2", "heading_2", "length_2",
    "heading_3",
)  # fmt: skip


class Place(NamedTuple):
    """A place where a body can start.

    Attributes:
        start: there.
        left: whether it comes from the left of the ego.
        along: where its way meets the ego's path [m].
    """

    start: Start
    left: bool
    along: float


@dataclass(frozen=True)
class Space:
    """A space of tests at one site.

    Attributes:
        site: with the places.
        places: where bodies can start: from the right, then from the left, along the ego's path.
        kind: of the bodies.
        teams: for each agent the indices of its bodies.
    """

    site: Site
    places: tuple[Place, ...]
    kind: Kind
    teams: Teams

    @property
    def bodies(self) -> int:
        """The number of bodies."""
        return sum(map(len, self.teams))

    @property
    def dimension(self) -> int:
        """How many numbers a point has: those of each body, and whether the others take part."""
        return self.bodies * len(NAMES) + self.bodies - 1

    def memories(self, point: Point) -> tuple[dict[str, Any], ...]:
        """The memories with which the agents of ``agents.searched`` play a point."""
        bodies = self._bodies(point)
        return tuple(
            {
                "starts": [list(start_record(self.site, bodies[i][0].start)) for i in team],
                "programmes": [bodies[i][1] and list(bodies[i][1] or ()) for i in team],
            }
            for team in self.teams
        )

    def place(self, point: Point, body: int) -> Place:
        """Where a body starts."""
        return self._bodies(point)[body][0]

    def seen(self, point: Point) -> list[tuple[Place, WalkProgramme]]:
        """Places and programmes of the bodies that take part."""
        return [(place, programme) for place, programme in self._bodies(point) if programme]

    def covered(self, points: Sequence[Point]) -> float:
        """The share of coarse cells (place, side, moment, speed) of the first body with a point."""
        stretches = {(p.left, p.along // STRETCH_M) for p in self.places}
        cells = set()
        for point in points:
            place = self.place(point, 0)
            thirds = (min(2, int(3 * point[NAMES.index(name)])) for name in ("zone", "speed"))
            cells.add((place.left, place.along // STRETCH_M, *thirds))
        return len(cells) / (9 * len(stretches))

    def _bodies(self, point: Point) -> list[tuple[Place, WalkProgramme | None]]:
        """The place and the programme of every body, None for one that stands by."""
        size, found = len(NAMES), list[tuple[Place, WalkProgramme | None]]()
        for i in range(self.bodies):
            numbers = [float(u) for u in point[i * size : (i + 1) * size]]
            takes_part = i == 0 or point[self.bodies * size + i - 1] < 0.5
            place = self._free(numbers[0], [p for p, _ in found])
            found.append((place, programme(numbers, self.kind) if takes_part else None))
        return found

    def _free(self, share: float, taken: Sequence[Place]) -> Place:
        """The place at a share of all, or the next one apart from those that are taken."""
        first = min(int(share * len(self.places)), len(self.places) - 1)
        for i in range(len(self.places)):
            place = self.places[(first + i) % len(self.places)]
            if all(_apart(place, other) for other in taken):
                return place
        raise NetworkError(f"no room for {self.bodies} testers on the pavements: use fewer")


def programme(numbers: Sequence[float], kind: Kind) -> WalkProgramme:
    """The programme of the numbers of one body, in the order of ``NAMES``, each in [0, 1]."""
    _, zone, speed, heading, depth, resume, speed_2, heading_2, length_2, heading_3 = numbers
    waits = resume > 0.5
    return WalkProgramme(
        zone=_within(ZONES, zone),
        speed=_within((SLOWEST_MPS, kind.v_max), speed),
        heading=_within((-OBLIQUE_RAD, OBLIQUE_RAD), heading),
        depth=_within(DEPTHS_M, depth),
        pause=0.0 if waits else max(0.0, resume - 0.1) / 0.4 * LONGEST_PAUSE_S,
        resume=_within(RESUMED, 2.0 * resume - 1.0) if waits else None,
        speed_2=_within((SLOWEST_MPS, kind.v_max), speed_2),
        heading_2=_within((-math.pi, math.pi), heading_2),
        length_2=LONGEST_M * length_2,
        heading_3=_within((-math.pi, math.pi), heading_3),
    )


def _within(bounds: tuple[float, float], share: float) -> float:
    """The number at a share of an interval."""
    return bounds[0] + share * (bounds[1] - bounds[0])


def _apart(one: Place, other: Place) -> bool:
    """Whether two bodies can start at two places."""
    a, b = one.start, other.start
    return math.dist((a.x, a.y), (b.x, b.y)) > APART_M


def space_of(site: Site, kind: Kind, teams: Teams) -> Space:
    """The space of tests at a site; raises NetworkError where it holds no start."""
    places = sorted(_places(site, kind), key=lambda p: (p.left, p.along))
    if not places:
        raise NetworkError(
            f"{site.net}: a search finds no place for a pedestrian whose way across meets the "
            f"ego's route {NEAREST_M:g} m or more from its beginning; choose another --ego-route"
        )
    return Space(site, tuple(places), kind, teams)


def _places(site: Site, kind: Kind) -> list[Place]:
    """All places on the pavements of a site from which the ego can be met."""
    margin = math.hypot(kind.length, kind.width) / 2
    found = []
    for area in site.areas:
        low, high = max(area.begin, margin), min(area.end, area.pavement.length - margin)
        for i in range(max(0, math.floor((high - low) / PLACE_M) + 1)):
            x, y, o = area.pavement.at(low + i * PLACE_M)
            way = site.roads.crossing(x, y)
            met = site.route.path.meet(x, y, way.heading) if way else None
            if way is None or met is None or met[1] < NEAREST_M:
                continue
            left = math.sin(site.route.path.at(met[1])[2] - way.heading) > 0.0
            start = Start(x, y, o, area.pavement, 0.0, True, area.walk)
            found.append(Place(start, left, met[1]))
    return found
