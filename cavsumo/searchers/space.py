"""The space of tests: a point of the unit cube is where the bodies start and what they do.

Each number of a point is a coordinate: of a body, with a name. The names are those of the movements
of a kind of body (``walks``); each further body also takes part or stands by.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from cavsumo.agents.programme import WalkProgramme
from cavsumo.agents.recorded import Teams
from cavsumo.errors import NetworkError
from cavsumo.model.bodies import Kind
from cavsumo.network.recorded_starts import start_record
from cavsumo.network.site import Site
from cavsumo.searchers.places import Place
from cavsumo.searchers.walks import walks_at

Point = NDArray[np.float64]  # shape (dimension,), each number in [0, 1]
Programme = WalkProgramme

STRETCH_M = 20.0  # length of a cell along the ego's path
PRESENCE = "presence"  # below one half a further body takes part
FURTHER = (PRESENCE,)  # names of the additional numbers of each further body


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
        names: of the numbers of one body; "place", "zone" and "speed" are among them.
        manner: of those whose thirds tell manners of moving apart.
    """

    @property
    def name(self) -> str: ...

    @property
    def kind(self) -> Kind: ...

    @property
    def places(self) -> tuple[Place, ...]: ...

    @property
    def names(self) -> tuple[str, ...]: ...

    @property
    def manner(self) -> tuple[str, ...]: ...

    def suited(self, shares: Mapping[str, float]) -> tuple[Place, ...]:
        """The places that suit the other numbers of a body, in their order; there is always one."""

    def realised(self, place: Place, shares: Mapping[str, float]) -> tuple[Place, Programme]:
        """Where a body starts at one of the places, and its programme, by its numbers."""

    def apart(self, one: Place, other: Place) -> bool:
        """Whether two bodies can start at two places."""


@dataclass(frozen=True)
class Space:
    """A space of tests at one site.

    Attributes:
        site: with the places.
        movements: that the bodies can have.
        teams: for each agent the indices of its bodies.
    """

    site: Site
    movements: Movements
    teams: Teams

    @property
    def bodies(self) -> int:
        """The number of bodies."""
        return sum(map(len, self.teams))

    @cached_property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """The meaning of each number of a point: those of each body, then of the further ones."""
        own = (Coordinate(i, n) for i in range(self.bodies) for n in self.movements.names)
        more = (Coordinate(i, n) for i in range(1, self.bodies) for n in FURTHER)
        return (*own, *more)

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

    def manner(self, point: Point, body: int = 0) -> tuple[int, ...]:
        """The manner of moving of a body, as thirds of the numbers that tell manners apart."""
        names = self.movements.manner
        return tuple(_third(self.share(point, body, name)) for name in names)

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

    def seen(self, point: Point) -> list[tuple[Place, Programme]]:
        """Places and programmes of the bodies that take part."""
        return [(place, programme) for place, programme in self._bodies(point) if programme]

    def covered(self, points: Sequence[Point]) -> float:
        """The share of coarse cells (place, side, moment, speed) of the first body with a point."""
        stretches = {(p.left, p.along // STRETCH_M) for p in self.movements.places}
        cells = set()
        for point in points:
            place = self.place(point, 0)
            thirds = (_third(self.share(point, 0, name)) for name in ("zone", "speed"))
            cells.add((place.left, place.along // STRETCH_M, *thirds))
        return len(cells) / (9 * len(stretches))

    def _bodies(self, point: Point) -> list[tuple[Place, Programme | None]]:
        """The place and the programme of every body, None for one that stands by."""
        found = list[tuple[Place, Programme | None]]()
        for i in range(self.bodies):
            shares = {n: self.share(point, i, n) for n in self.movements.names}
            takes_part = i == 0 or self.share(point, i, PRESENCE) < 0.5
            place, programme = self._free(shares, [p for p, _ in found])
            found.append((place, programme if takes_part else None))
        return found

    def _free(self, shares: Mapping[str, float], taken: Sequence[Place]) -> tuple[Place, Programme]:
        """A body at the place at a share of those that suit it, or at the next one that is free."""
        places = self.movements.suited(shares)
        first = min(int(shares["place"] * len(places)), len(places) - 1)
        for i in range(len(places)):
            place, programme = self.movements.realised(places[(first + i) % len(places)], shares)
            if all(self.movements.apart(place, other) for other in taken):
                return place, programme
        raise NetworkError(f"no room for {self.bodies} testers: use fewer")


def _third(share: float) -> int:
    """Which third of [0, 1] a number is in."""
    return min(2, int(3 * share))


def space_of(site: Site, kind: Kind, teams: Teams) -> Space:
    """The space of tests at a site; raises NetworkError where it holds no start."""
    return Space(site, walks_at(site, kind), teams)
