"""Encounters with cyclists and drivers: who comes from where and when, and whether they give way.

As in ``encounters``, each body has coordinates that are uniform on [0, 1] by chance. Somebody who
wants to be faster than the kind of body can be is as fast as that.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from cavsumo.agents.programmed_manoeuvres import DriveProgramme
from cavsumo.agents.recorded import Teams
from cavsumo.errors import InputError, NetworkError
from cavsumo.model.bodies import BICYCLE, CAR, Kind
from cavsumo.model.carriageway import Approach, Start
from cavsumo.model.geometry import Box, gap
from cavsumo.network.site import Site
from cavsumo.network.vehicle_starts import APART_M
from cavsumo.probability.encounter_space import EncounterSpace
from cavsumo.probability.exposure import VehicleExposure
from cavsumo.probability.stratified import Cut
from cavsumo.probability.tree import Floats
from cavsumo.searchers.places import NEAREST_M

NAMES = ("approach", "arrival", "speed", "gap", "attention")
ON_RED = "compliance"  # where the ego's route has lights
SLOWEST_MPS = 1.0
CALM = 0.5  # effort with which they accelerate
RUN_UP_S = 8.0  # longest way before the line, as time at the desired speed
DEPARTING_S = 1.5  # lost by accelerating
KINDS = (BICYCLE.name, CAR.name)


@dataclass(frozen=True)
class VehicleEncounters(EncounterSpace):
    """Encounters with vehicles.

    Attributes:
        approaches: the ways that cross the ego's or lead into it: all alike.
        ego: the kind of the ego.
        exposure: what they do by chance.
    """

    approaches: tuple[Approach, ...]
    ego: Kind
    exposure: VehicleExposure

    @property
    def per_hour(self) -> float:
        """Arrivals an hour."""
        return self.exposure.arrivals.per_hour

    @property
    def cuts(self) -> tuple[Cut, ...]:
        """The shares at which behaviour changes."""
        chance = self.exposure
        return self.cuts_at(
            {
                "attention": chance.attention.inattentive,
                ON_RED: chance.compliance.against_red,
            }
        )

    def memories(self, vector: Floats) -> tuple[dict[str, Any], ...]:
        """The memories with which the agents of ``agents.exposed`` play a vector."""
        starts, drivers = list[Start](), list[dict[str, Any]]()
        for drawn in self.drawn(vector):
            speed = min(
                self.kind.v_max, self.exposure.speed_mps.quantile(drawn["speed"], SLOWEST_MPS)
            )
            starts.append(self._start(drawn, speed, starts))
            drivers.append(self._driver(drawn, speed))
        return self.told(starts, "drivers", drivers)

    def _driver(self, drawn: dict[str, float], speed: float) -> dict[str, Any]:
        """The behaviour of one body."""
        chance = self.exposure
        programme = DriveProgramme(
            cue=0.0, speed=speed, effort=CALM, depth=None, pause=0.0, resume=None, speed_2=speed
        )
        return {
            "arrival_s": self._arrival(drawn),
            "critical_gap_s": chance.critical_gap_s.quantile(drawn["gap"]),
            "looks": drawn["attention"] >= chance.attention.inattentive,
            "complies": drawn.get(ON_RED, 1.0) >= chance.compliance.against_red,
            "programme": list(programme),
        }

    def _start(self, drawn: dict[str, float], speed: float, taken: Sequence[Start]) -> Start:
        """Where a body stands at first: as far before its line as there is time to its arrival."""
        count = len(self.approaches)
        first = min(int(drawn["approach"] * count), count - 1)
        others = [self._box(one, self.kind) for one in taken]
        others.append(Box(*self.site.route.path.at(0.0), self.ego.length, self.ego.width))
        for i in range(count):
            approach = self.approaches[(first + i) % count]
            time = approach.ego_enter / approach.ego_speed - self._arrival(drawn) - DEPARTING_S
            way = min(speed, approach.speed) * min(RUN_UP_S, max(0.0, time))
            x, y, o = approach.path.at(max(self.kind.length / 2, approach.wait - way))
            start = Start(x, y, o, approach=approach, v=0.0)
            if all(gap(self._box(start, self.kind), other) > APART_M for other in others):
                return start
        raise NetworkError(f"no room for {self.bodies} vehicles: use fewer")

    def _arrival(self, drawn: dict[str, float]) -> float:
        """Time that the ego has left at the arrival of a body [s]."""
        return drawn["arrival"] * self.exposure.arrivals.within_s

    @staticmethod
    def _box(start: Start, kind: Kind) -> Box:
        return Box(start.x, start.y, start.o, kind.length, kind.width)


def vehicle_encounters(
    site: Site, kind: Kind, ego: Kind, teams: Teams, exposure: VehicleExposure, named: str
) -> VehicleEncounters:
    """The encounters with vehicles at a site; raises InputError without support there."""
    try:
        exposure.speed_mps.within(SLOWEST_MPS, math.inf)
    except ValueError as error:
        raise InputError(f"{named}: {kind.name}.speed_mps: {error}, its speeds") from error
    ways = tuple(
        one for one in site.approaches if math.isfinite(one.wait) and one.ego_enter >= NEAREST_M
    )
    if not ways:
        raise NetworkError(
            f"{site.net}: no way on which a {kind.name} crosses the ego's route {NEAREST_M:g} m or "
            "more from its beginning; choose another --ego-route"
        )
    names = (*NAMES, ON_RED) if site.lights else NAMES
    return VehicleEncounters(site, kind, teams, names, ways, ego, exposure)
