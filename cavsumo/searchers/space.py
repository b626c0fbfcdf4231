"""The space of tests: a point of the unit cube is where the bodies start and what they do.

Each number of a point is a coordinate: of a body, with a name. The names are those of the movements
of a kind of body (``walks``, ``drives``). Each further body may stand by, or act together with the
first one, near it and at about the same moment. Against an ego that decides only now and then the
moment in its interval at which the first body begins is one number more.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from cavsumo.agents.cues import BRAKES, SPEEDS_UP
from cavsumo.agents.recorded import Teams
from cavsumo.agents.searched import Programme
from cavsumo.errors import NetworkError
from cavsumo.model.bodies import CAR, WALKING, Kind
from cavsumo.network.recorded_starts import start_record
from cavsumo.network.site import Site
from cavsumo.searchers.drives import drives_at
from cavsumo.searchers.places import LONGEST_DELAY_S, Place
from cavsumo.searchers.walks import walks_at

Point = NDArray[np.float64]  # shape (dimension,), each number in [0, 1]

STRETCH_M = 20.0  # length of a cell along the ego's path
NEAR_M = 8.0  # bodies that act together meet the ego's path no farther apart
MOMENTS = 0.4  # and at zones that differ by no more than half of this share of all

FURTHER = {
    "company": "whether a further body stands by, acts by itself, or together with the first",
    "reaction": "whether a further body begins by the ego's place, or as it brakes or speeds up",
}
ALONE, TOGETHER = 0.25, 0.45  # shares of "company" from which on it acts by itself, and together
AS_IT_BRAKES, AS_IT_SPEEDS_UP = 0.6, 0.8  # shares of "reaction" from which on it is awaited
PHASE = {"phase": "when the first body begins, between two decisions of the ego"}


class Coordinate(NamedTuple):
    """A number of a point: of a body, by its name."""

    body: int
    name: str


class Movements(Protocol):
    """The movements that bodies of a kind can have in the tests of a space.

    Attributes:
        name: of these movements.
        kind: of the bodies.
        places: where bodies can start, in an order in which neighbours are alike.
        meanings: of the numbers of one body, by their names; "place", "zone" and "speed" are
            among them.
        manner: names of those whose thirds tell manners of moving apart.
        scales: for those that can be bounded, the numbers at the shares 0 and 1, in SI units and
            degrees.
    """

    @property
    def name(self) -> str: ...

    @property
    def kind(self) -> Kind: ...

    @property
    def places(self) -> tuple[Place, ...]: ...

    @property
    def meanings(self) -> Mapping[str, str]: ...

    @property
    def manner(self) -> tuple[str, ...]: ...

    @property
    def scales(self) -> Mapping[str, tuple[float, float]]: ...

    def suited(self, shares: Mapping[str, float]) -> tuple[Place, ...]:
        """The places that suit the other numbers of a body, in their order; there is always one."""

    def realised(self, place: Place, shares: Mapping[str, float]) -> tuple[Place, Programme]:
        """Where a body starts at one of the places, and its programme, by its numbers."""

    def fits(self, place: Place, others: Sequence[Place]) -> bool:
        """Whether a body can start at a place, apart from others."""


@dataclass(frozen=True)
class Space:
    """A space of tests at one site.

    Attributes:
        site: with the places.
        movements: that the bodies can have.
        teams: for each agent the indices of its bodies.
        every: time between two decisions of the ego; 0 if it decides in every timestep [s].
    """

    site: Site
    movements: Movements
    teams: Teams
    every: float = 0.0

    @property
    def bodies(self) -> int:
        """The number of bodies."""
        return sum(map(len, self.teams))

    @cached_property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """The coordinates of a point: those of each body, of the further ones, the phase."""
        own = [Coordinate(i, n) for i in range(self.bodies) for n in self.movements.meanings]
        more = [Coordinate(i, n) for i in range(1, self.bodies) for n in FURTHER]
        return (*own, *more, *(Coordinate(0, n) for n in PHASE if self.every))

    @cached_property
    def _index(self) -> dict[Coordinate, int]:
        return {coordinate: i for i, coordinate in enumerate(self.coordinates)}

    @property
    def dimension(self) -> int:
        """How many numbers a point has."""
        return len(self.coordinates)

    def index(self, body: int, name: str) -> int:
        """Which number of a point it is; KeyError for none."""
        return self._index[Coordinate(body, name)]

    def share(self, point: Point, body: int, name: str) -> float:
        """One number of a point."""
        return float(point[self.index(body, name)])

    def shares(self, point: Point, body: int) -> dict[str, float]:
        """The numbers of a body, by their names; the zone of one that acts with the first follows.

        Its place stays relative to that of the first.
        """
        found = {name: self.share(point, body, name) for name in self.movements.meanings}
        if body and self.share(point, body, "company") >= TOGETHER:
            moment = self.share(point, 0, "zone") + MOMENTS * (found["zone"] - 0.5)
            found["zone"] = min(1.0, max(0.0, moment))
        return found

    def manner(self, point: Point, body: int = 0) -> tuple[int, ...]:
        """The manner of moving of a body, as thirds of the numbers that tell manners apart."""
        names = self.movements.manner
        return tuple(_third(self.share(point, body, name)) for name in names)

    def memories(self, point: Point) -> tuple[dict[str, Any], ...]:
        """The memories with which the agents of ``agents.searched`` play a point."""
        bodies = self.played(point)
        return tuple(
            {
                "starts": [list(start_record(self.site, bodies[i][0].start)) for i in team],
                "programmes": [_plain(bodies[i][1]) for i in team],
            }
            for team in self.teams
        )

    def place(self, point: Point, body: int) -> Place:
        """Where a body starts."""
        return self.played(point)[body][0]

    def covered(self, points: Sequence[Point]) -> float:
        """The share of coarse cells (place, side, moment, speed) of the first body with a point."""
        stretches = {(p.whence, p.along // STRETCH_M) for p in self.movements.places}
        cells = set()
        for point in points:
            place = self.place(point, 0)
            thirds = (_third(self.share(point, 0, name)) for name in ("zone", "speed"))
            cells.add((place.whence, place.along // STRETCH_M, *thirds))
        return len(cells) / (9 * len(stretches))

    def played(self, point: Point) -> list[tuple[Place, Programme | None]]:
        """The place and the programme of every body, None for one that stands by."""
        place, programme = self._first(point)
        found: list[tuple[Place, Programme | None]] = [(place, programme)]
        for i in range(1, self.bodies):
            found.append(self._further(point, i, [p for p, _ in found]))
        return found

    def _first(self, point: Point) -> tuple[Place, Programme]:
        """The place and the programme of the first body."""
        shares = self.shares(point, 0)
        place, programme = self._free(shares, self.movements.suited(shares), [])
        if not self.every:
            return place, programme
        phase = self.share(point, 0, "phase") * self.every
        return place, programme._replace(every=self.every, phase=phase)

    def _further(
        self, point: Point, body: int, taken: Sequence[Place]
    ) -> tuple[Place, Programme | None]:
        """The place and the programme of a further body."""
        shares, company = self.shares(point, body), self.share(point, body, "company")
        reaction, zone = self.share(point, body, "reaction"), self.share(point, body, "zone")
        places: Sequence[Place] = self.movements.suited(shares)
        if company >= TOGETHER:
            places = _near(taken[0], shares["place"], self.movements.places)
            shares["place"] = 0.0
        place, programme = self._free(shares, places, taken)
        if reaction >= AS_IT_BRAKES:
            cue = BRAKES if reaction < AS_IT_SPEEDS_UP else SPEEDS_UP
            programme = programme._replace(cue=cue, delay=zone * LONGEST_DELAY_S)
        return place, programme if company >= ALONE else None

    def _free(
        self, shares: Mapping[str, float], wanted: Sequence[Place], taken: Sequence[Place]
    ) -> tuple[Place, Programme]:
        """A body at the place at a share of those wanted, or at the next one that is free."""
        first = min(int(shares["place"] * len(wanted)), len(wanted) - 1)
        for one in (*wanted[first:], *wanted[:first], *self.movements.places):
            place, programme = self.movements.realised(one, shares)
            if self.movements.fits(place, taken):
                return place, programme
        raise NetworkError(f"{self.site.net}: no room for {self.bodies} testers: use fewer")


def _near(first: Place, share: float, places: Sequence[Place]) -> list[Place]:
    """The places where a body acts together with one at the first place, the wanted one first.

    Below one half it is one on the same side, else on another: from NEAR_M before the first, along
    the ego's path, to NEAR_M beyond it.
    """
    same = share < 0.5
    wanted = first.along + NEAR_M * (4.0 * (share if same else share - 0.5) - 1.0)

    def unlike(place: Place) -> tuple[bool, float, float]:
        other_side = (place.whence == first.whence) is not same
        return other_side, abs(place.along - wanted), abs(place.lead - first.lead)

    return sorted(places, key=unlike)


def _third(share: float) -> int:
    """Which third of [0, 1] a number is in."""
    return min(2, int(3 * share))


def _plain(programme: Programme | None) -> dict[str, Any] | None:
    """A programme as plain data."""
    return None if programme is None else programme._asdict()


def space_of(
    site: Site,
    kind: Kind,
    teams: Teams,
    *,
    ego: Kind = CAR,
    start_speed: float | None = None,
    every: float = 0.0,
) -> Space:
    """The space of tests at a site; raises NetworkError where it holds no start.

    Args:
        kind: of the testers.
        ego: its kind.
        start_speed: of vehicles [m/s]; None leaves it to their numbers.
        every: time between two decisions of the ego; 0 if it decides in every timestep [s].
    """
    on_foot = kind.name in WALKING
    movements = walks_at(site, kind) if on_foot else drives_at(site, kind, ego, start_speed)
    space = Space(site, movements, teams, every)
    space.memories(np.zeros(space.dimension))  # there is room for all
    return space
