"""Encounters with pedestrians: a random vector says who arrives where and when, and what they do.

Each body has the coordinates ``NAMES``, each uniform on [0, 1] by chance, so the density of an
encounter under the exposure is 1 and that of a vector of another proposal is the proposal's own:
likelihood ratios are exact.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cavsumo.agents.programme import WalkProgramme
from cavsumo.agents.recorded import Teams
from cavsumo.errors import InputError, NetworkError
from cavsumo.model.bodies import CAR, WALKING, Kind
from cavsumo.network.pedestrian_starts import APART_M
from cavsumo.network.site import Site
from cavsumo.probability.encounter_space import EncounterSpace
from cavsumo.probability.exposure import Exposure, exposure_of
from cavsumo.probability.stratified import Cut
from cavsumo.probability.tree import Floats
from cavsumo.probability.vehicle_encounters import KINDS, VehicleEncounters, vehicle_encounters
from cavsumo.searchers.places import Place
from cavsumo.searchers.walks import walks_at

NAMES = ("place", "arrival", "speed", "gap", "attention")
ON_RED = "compliance"  # where there is a signalled crossing
STOPS = ("hesitates", "where")  # where anybody stops on the road
SLOWEST_MPS = 0.3
DEPTHS_M = (-1.0, 1.0)  # where somebody stops, from the edge of the ego's strip


@dataclass(frozen=True)
class Encounters(EncounterSpace):
    """Encounters with pedestrians.

    Attributes:
        places: where they arrive: all places alike.
        exposure: what they do by chance.
    """

    places: tuple[Place, ...]
    exposure: Exposure

    @property
    def per_hour(self) -> float:
        """Arrivals an hour."""
        return self.exposure.arrivals.per_hour

    @property
    def cuts(self) -> tuple[Cut, ...]:
        """The shares at which behaviour changes, in the order of the coordinates."""
        chance = self.exposure
        return self.cuts_at(
            {
                "attention": chance.attention.inattentive,
                ON_RED: chance.compliance.against_red,
                STOPS[0]: chance.hesitation.share,
            }
        )

    def memories(self, vector: Floats) -> tuple[dict[str, Any], ...]:
        """The memories with which the agents of ``agents.exposed`` play a vector."""
        taken, walkers = list[Place](), list[dict[str, Any]]()
        for drawn in self.drawn(vector):
            taken.append(self._place(drawn["place"], taken))
            walkers.append(self._walker(drawn))
        return self.told([place.start for place in taken], "walkers", walkers)

    def _walker(self, drawn: dict[str, float]) -> dict[str, Any]:
        """The behaviour of one body."""
        chance, top = self.exposure, self.kind.v_max
        speed = chance.speed_mps.quantile(drawn["speed"], SLOWEST_MPS, top)
        arrival = drawn["arrival"] * chance.arrivals.within_s
        looks = drawn["attention"] >= chance.attention.inattentive
        accepts = not looks or arrival >= chance.critical_gap_s.quantile(drawn["gap"])
        return {
            "arrival_s": arrival,
            "accepts": accepts,
            "complies": drawn.get(ON_RED, 1.0) >= chance.compliance.against_red,
            "programme": list(self._programme(speed, drawn)),
        }

    def _programme(self, speed: float, drawn: dict[str, float]) -> WalkProgramme:
        """The way across: straight, without a stop or with one."""
        share, u = self.exposure.hesitation.share, drawn.get(STOPS[0], 1.0)
        stops = u < share
        pause = self.exposure.hesitation.pause_s.quantile(u / share) if stops else 0.0
        low, high = DEPTHS_M
        depth = low + drawn.get(STOPS[1], 0.0) * (high - low)
        return WalkProgramme(
            cue=0.0, speed=speed, heading=0.0, depth=depth, pause=pause, resume=None,
            speed_2=speed, heading_2=0.0, length_2=0.0, heading_3=0.0,
        )  # fmt: skip

    def _place(self, share: float, taken: Sequence[Place]) -> Place:
        """The place at a share of all, or the next one apart from those that are taken."""
        count = len(self.places)
        first = min(int(share * count), count - 1)
        for i in range(count):
            place = self.places[(first + i) % count]
            here = place.start
            if all(math.dist((here.x, here.y), (t.start.x, t.start.y)) > APART_M for t in taken):
                return place
        raise NetworkError(f"no room for {self.bodies} testers on the pavements: use fewer")


def encounters_for(
    params: Mapping[str, Any], site: Site, kind: Kind, teams: Teams
) -> Encounters | VehicleEncounters:
    """The encounters of the exposure that an agent's parameters name; raises InputError."""
    exposure, named = exposure_of(params)
    return encounters_of(site, kind, teams, exposure, named=named)


def encounters_of(
    site: Site,
    kind: Kind,
    teams: Teams,
    exposure: Exposure,
    ego: Kind = CAR,
    named: str = "exposure",
) -> Encounters | VehicleEncounters:
    """The encounters at a site; raises InputError where the exposure has no support there.

    Args:
        site, kind, teams: where they are, the kind of bodies, and for each agent their indices.
        exposure: what they do by chance.
        ego: the kind of the ego, which vehicles start apart from.
        named: the exposure in the sentence of an error.
    """
    if kind.name in KINDS:
        return vehicle_encounters(site, kind, ego, teams, getattr(exposure, kind.name), named)
    if kind.name not in WALKING:
        known = f"{', '.join(WALKING)}, {' and '.join(KINDS)}"
        raise InputError(f"{named}: kind {kind.name!r}: only {known} have one")
    try:
        exposure.speed_mps.within(SLOWEST_MPS, kind.v_max)
    except ValueError as error:
        raise InputError(f"{named}: speed_mps: {error}, the speeds of a {kind.name}") from error
    names = [*NAMES, *([ON_RED] if any(one.signalled for one in site.marked) else [])]
    names += STOPS if exposure.hesitation.share > 0.0 else ()
    places = walks_at(site, kind).places
    return Encounters(site, kind, teams, tuple(names), places, exposure)
