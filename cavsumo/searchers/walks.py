"""The movements of pedestrians in a space of tests: their numbers, places and programmes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import compress
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from cavsumo.agents.cues import zone_m
from cavsumo.agents.programme import WalkProgramme, entry_of
from cavsumo.errors import NetworkError
from cavsumo.model.bodies import CAR, Kind
from cavsumo.model.carriageway import Limit, Start
from cavsumo.network.pedestrian_starts import APART_M, starting_range
from cavsumo.network.site import Site
from cavsumo.searchers.places import (
    FROM_LEFT,
    FROM_RIGHT,
    NEAREST_M,
    Place,
    pause_of,
    within,
)

PLACE_M = 0.5  # distance of two places along a pavement
SLOWEST_MPS = 0.3
OBLIQUE_RAD = math.radians(60.0)  # of the first leg, to either side
ZONES = (-0.8, 1.6)  # where an ego that does not react would be as a body comes into its way
DEPTHS_M = (-1.5, 3.0)
LONGEST_M = 5.0  # of the second leg

Numbers = NDArray[np.float64]
Few = tuple[Numbers, NDArray[np.intp]]


@dataclass(frozen=True)
class Walks:
    """The movements of pedestrians at one site (``space.Movements``)."""

    kind: Kind
    places: tuple[Place, ...]
    limits: tuple[Limit, ...] = ()

    name: ClassVar[str] = "walks"
    meanings: ClassVar[Mapping[str, str]] = {
        "place": "where it starts, along the pavements of the ego's route",
        "zone": "where the ego will be as it comes into the ego's way",
        "speed": "of the first leg",
        "heading": "of the first leg, from towards the ego to away from it",
        "depth": "how far in the ego's way the first leg ends",
        "resume": "when it goes on",
        "speed_2": "of the second leg",
        "heading_2": "of the second leg",
        "length_2": "of the second leg",
        "heading_3": "of the last leg",
    }
    manner: ClassVar[tuple[str, ...]] = ("speed", "heading", "depth")

    @property
    def scales(self) -> Mapping[str, tuple[float, float]]:
        """The bounds of the numbers that are even, angles in degrees."""
        speeds, oblique = (SLOWEST_MPS, self.kind.v_max), math.degrees(OBLIQUE_RAD)
        return {
            "zone": ZONES,
            "speed": speeds,
            "heading": (-oblique, oblique),
            "depth": DEPTHS_M,
            "speed_2": speeds,
            "heading_2": (-180.0, 180.0),
            "length_2": (0.0, LONGEST_M),
            "heading_3": (-180.0, 180.0),
        }

    def suited(self, shares: Mapping[str, float]) -> tuple[Place, ...]:
        """The places from which the programme of the numbers can be in time; all if none can.

        The ego is expected to drive at the limit.
        """
        walk = walk_of(shares, self.kind)
        return self.in_time(walk) or self.places

    def in_time(self, walk: WalkProgramme) -> tuple[Place, ...]:
        """The places where the ego is still to come when a body has to step off for a programme."""
        if isinstance(walk.cue, str):
            return self.places
        along, (limits, of_limit), (aways, of_away) = self._ways
        entered = np.array([entry_of(walk, away, self.kind) for away in aways.tolist()])[of_away]
        zone = np.array([zone_m(walk.cue, v) for v in limits.tolist()])[of_limit]
        in_time = along + entered[:, 1] >= limits[of_limit] * entered[:, 0] + zone
        return tuple(compress(self.places, in_time))

    def realised(self, place: Place, shares: Mapping[str, float]) -> tuple[Place, WalkProgramme]:
        """The place as it is, and the programme of the numbers."""
        return place, walk_of(shares, self.kind)

    @cached_property
    def _ways(self) -> tuple[Numbers, Few, Few]:
        """Where each place meets the ego's path [m], the limits there [m/s], the ways to the strip.

        The last two have few different values: those, and which of them is that of each place.
        """
        along = np.array([place.along for place in self.places])
        limits = [[0.0, *(one.speed for one in self.limits if one.along <= at)][-1] for at in along]
        aways = [round(place.away, 2) for place in self.places]  # [m]
        return along, np.unique(limits, return_inverse=True), np.unique(aways, return_inverse=True)

    def fits(self, place: Place, others: Sequence[Place]) -> bool:
        """Whether a body can start at a place, apart from others."""
        x, y = place.start.x, place.start.y
        return all(math.dist((x, y), (o.start.x, o.start.y)) > APART_M for o in others)


def walk_of(shares: Mapping[str, float], kind: Kind) -> WalkProgramme:
    """The programme of the numbers of one body, each in [0, 1]."""
    speeds = SLOWEST_MPS, kind.v_max
    pause, resume = pause_of(shares["resume"])
    return WalkProgramme(
        cue=within(ZONES, shares["zone"]),
        speed=within(speeds, shares["speed"]),
        heading=within((-OBLIQUE_RAD, OBLIQUE_RAD), shares["heading"]),
        depth=within(DEPTHS_M, shares["depth"]),
        pause=pause,
        resume=resume,
        speed_2=within(speeds, shares["speed_2"]),
        heading_2=within((-math.pi, math.pi), shares["heading_2"]),
        length_2=LONGEST_M * shares["length_2"],
        heading_3=within((-math.pi, math.pi), shares["heading_3"]),
    )


def walks_at(site: Site, kind: Kind) -> Walks:
    """The movements of pedestrians at a site; raises NetworkError where nobody meets the ego."""
    places = sorted(_places(site, kind), key=lambda p: (p.left, p.along))
    if not places:
        raise NetworkError(
            f"{site.net}: a search finds no place for a pedestrian whose way across meets the "
            f"ego's route {NEAREST_M:g} m or more from its beginning; choose another --ego-route"
        )
    return Walks(kind, tuple(places), site.limits)


def _places(site: Site, kind: Kind) -> list[Place]:
    """All places on the pavements of a site from which the ego can be met."""
    found = []
    for area in site.areas:
        low, high = starting_range(area, kind)
        for i in range(math.floor((high - low) / PLACE_M) + 1):
            x, y, o = area.pavement.at(low + i * PLACE_M)
            way = site.roads.crossing(x, y)
            met = site.route.path.meet(x, y, way.heading) if way else None
            if way is None or met is None or met[1] < NEAREST_M:
                continue
            strip = met[0] - (CAR.width + kind.length) / 2
            left = math.sin(site.route.path.at(met[1])[2] - way.heading) > 0.0
            start = Start(x, y, o, area.pavement, 0.0, True, area.walk)
            side = FROM_LEFT if left else FROM_RIGHT
            found.append(Place(start, side, met[1], away=max(0.0, strip)))
    return found
