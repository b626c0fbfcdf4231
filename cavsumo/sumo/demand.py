"""The background traffic of a scenario, recorded once and sent again into a running simulation.

SUMO reads a route file along its own clock, so a simulation for many episodes cannot use it.
Instead the demand is played once without ego and testers, and all departures are recorded with
time, place, speed and route. Each episode then gets these departures again, counted from its own
beginning. SUMO's own random numbers (speed factors, dawdling) are drawn anew.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from cavsumo.errors import InputError
from cavsumo.model.departures import Attributes, Demand, Stage, Trip, Walk

BEYOND_S = 60.0  # how far beyond the horizon there must be demand, for waits and overtime
WALKING = 2  # SUMO's number of the stage in which a person walks
WAITING = 1  # and in which one waits
# Elements of a route file besides departures.
LASTING = ("vType", "vTypeDistribution", "route", "routeDistribution")


def types_only(route_file: Path) -> str:
    """The vehicle types and named routes of a route file, as an additional file.

    Raises InputError for what is no XML.
    """
    kept = ElementTree.Element("additional")
    try:
        root = ElementTree.parse(route_file).getroot()
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        raise InputError(f"routes {str(route_file)!r}: not well-formed XML") from error
    kept.extend(element for element in root if element.tag in LASTING)
    return ElementTree.tostring(kept, encoding="unicode")


def noted(sumo: Any, duration: float) -> Demand:
    """Play the simulation that has been started for a duration [s], and note who departs."""
    notes = DepartureNotes({}, frozenset())
    while (now := sumo.simulation.getTime()) < duration:
        sumo.simulationStep()
        notes.add(sumo, now)
    return notes.demand()


class DepartureNotes:
    """Departures so far in a simulation.

    Args:
        types: of the demand.
        apart: ids of those who are no background.
    """

    def __init__(self, types: Mapping[str, Attributes], apart: frozenset[str]) -> None:
        self._types, self._apart = types, apart
        self._trips: list[Trip] = []
        self._walks: list[Walk] = []

    def add(self, sumo: Any, now: float) -> None:
        """Note who departed in the timestep that began at a time [s]."""
        for name in sumo.simulation.getDepartedIDList():
            if name not in self._apart:
                self._trips.append(_trip(sumo.vehicle, now, name))
        for name in sumo.simulation.getDepartedPersonIDList():
            if name not in self._apart:
                self._walks.append(_walk(sumo.person, now, name))

    def demand(self) -> Demand:
        """All of them, with the types that they are of."""
        used = {trip.type for trip in self._trips} | {walk.type for walk in self._walks}
        types = {name: type_ for name, type_ in self._types.items() if name in used}
        return Demand(tuple(self._trips), tuple(self._walks), types)


def _trip(vehicle: Any, now: float, name: str) -> Trip:
    """A vehicle that has just departed."""
    return Trip(
        round(now, 3),
        name,
        vehicle.getTypeID(name),
        tuple(vehicle.getRoute(name)),
        vehicle.getLaneIndex(name),
        vehicle.getLanePosition(name),
        vehicle.getSpeed(name),
        vehicle.getSpeedFactor(name),
    )


def _walk(person: Any, now: float, name: str) -> Walk:
    """A person that has just departed; raises InputError unless it only walks and waits."""
    stages = [person.getStage(name, i) for i in range(person.getRemainingStages(name))]
    for stage in stages:
        if stage.type not in (WALKING, WAITING):
            raise InputError(f"reset shared: person {name!r} rides; only walks can be sent again")
    return Walk(
        round(now, 3),
        name,
        person.getTypeID(name),
        person.getRoadID(name),
        person.getLanePosition(name),
        person.getSpeedFactor(name),
        tuple(
            Stage(tuple(s.edges), s.arrivalPos) if s.type == WALKING else Stage((), s.travelTime)
            for s in stages
        ),
    )


class Departures:
    """A demand that is sent again, each body at its time.

    Args:
        sumo: SUMO's functions, of a simulation that was started without the demand.
        dt: length of its timesteps [s].
    """

    def __init__(self, sumo: Any, demand: Demand, dt: float) -> None:
        self._sumo, self._demand, self._dt = sumo, demand, dt
        for trip in demand.trips:
            sumo.route.add(f"cavsumo_{trip.id}", list(trip.edges))
        self.begin()

    def begin(self) -> None:
        """Count from now."""
        self._steps = 0
        self._trips, self._walks = iter(self._demand.trips), iter(self._demand.walks)
        self._next_trip = next(self._trips, None)
        self._next_walk = next(self._walks, None)

    def send(self) -> None:
        """Send the departures of the next timestep; call before each."""
        now = self._steps * self._dt + 1e-6
        self._steps += 1
        while self._next_trip is not None and self._next_trip.time <= now:
            self._let_trip(self._next_trip)
            self._next_trip = next(self._trips, None)
        while self._next_walk is not None and self._next_walk.time <= now:
            self._let_walk(self._next_walk)
            self._next_walk = next(self._walks, None)

    def _let_trip(self, trip: Trip) -> None:
        self._sumo.vehicle.add(
            trip.id,
            f"cavsumo_{trip.id}",
            typeID=trip.type,
            departLane=str(trip.lane),
            departPos=f"{trip.along}",
            departSpeed=f"{trip.speed}",
        )

    def _let_walk(self, walk: Walk) -> None:
        person = self._sumo.person
        person.add(walk.id, walk.edge, walk.along, typeID=walk.type)
        for edges, end in walk.stages:
            if edges:
                person.appendWalkingStage(walk.id, list(edges), end)
            else:
                person.appendWaitingStage(walk.id, end)


def cleared(sumo: Any) -> None:
    """Take every vehicle and person out of the simulation, also those that wait to enter."""
    for name in (*sumo.vehicle.getIDList(), *sumo.simulation.getPendingVehicles()):
        sumo.vehicle.remove(name)
    for name in sumo.person.getIDList():
        sumo.person.remove(name)
    sumo.simulationStep()


class Lights:
    """The traffic lights of a simulation as they were at its beginning."""

    def __init__(self, sumo: Any) -> None:
        self._lights, now = sumo.trafficlight, sumo.simulation.getTime()
        self._first = [
            (name, self._lights.getPhase(name), self._lights.getNextSwitch(name) - now)
            for name in self._lights.getIDList()
        ]

    def restore(self) -> None:
        """Restore them; static programs then run as they did."""
        for name, phase, left in self._first:
            self._lights.setPhase(name, phase)
            self._lights.setPhaseDuration(name, left)
