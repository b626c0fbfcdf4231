"""The background traffic of a scenario, noted once and sent again into a simulation that goes on.

SUMO reads a route file along its own clock, so a simulation that serves many episodes cannot use
it. Instead the demand is played once without ego and testers: who departs when, where, how fast,
on which route. Each episode then gets these departures again, counted from its own beginning. What
SUMO draws by itself (speed factors, dawdling) is drawn anew.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

from cavsumo.errors import InputError

BEYOND_S = 60.0  # how far beyond the horizon there must be demand, for waits and overtime
WALKING = 2  # SUMO's number of the stage in which a person walks
WAITING = 1  # and in which one waits
# What a route file may hold besides departures.
LASTING = ("vType", "vTypeDistribution", "route", "routeDistribution")


class Trip(NamedTuple):
    """The departure of a vehicle."""

    time: float  # s since the beginning
    id: str
    type: str
    edges: tuple[str, ...]
    lane: int
    along: float  # m
    speed: float  # m/s


class Walk(NamedTuple):
    """The departure of a person; each stage is edges and where it ends, or no edges and a wait."""

    time: float  # s since the beginning
    id: str
    type: str
    edge: str
    along: float  # m
    stages: tuple[tuple[tuple[str, ...], float], ...]


@dataclass(frozen=True)
class Demand:
    """All departures of a scenario in the order of their times."""

    trips: tuple[Trip, ...] = ()
    walks: tuple[Walk, ...] = ()


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
    trips: list[Trip] = []
    walks: list[Walk] = []
    while (now := sumo.simulation.getTime()) < duration:
        sumo.simulationStep()
        trips += [_trip(sumo.vehicle, now, v) for v in sumo.simulation.getDepartedIDList()]
        walks += [_walk(sumo.person, now, p) for p in sumo.simulation.getDepartedPersonIDList()]
    return Demand(tuple(trips), tuple(walks))


def _trip(vehicle: Any, now: float, name: str) -> Trip:
    """A vehicle that has just departed."""
    return Trip(
        now,
        name,
        vehicle.getTypeID(name),
        tuple(vehicle.getRoute(name)),
        vehicle.getLaneIndex(name),
        vehicle.getLanePosition(name),
        vehicle.getSpeed(name),
    )


def _walk(person: Any, now: float, name: str) -> Walk:
    """A person who has just departed; raises InputError for one who does not just walk or wait."""
    stages = [person.getStage(name, i) for i in range(person.getRemainingStages(name))]
    for stage in stages:
        if stage.type not in (WALKING, WAITING):
            raise InputError(f"reset shared: person {name!r} rides; only walks can be sent again")
    return Walk(
        now,
        name,
        person.getTypeID(name),
        person.getRoadID(name),
        person.getLanePosition(name),
        tuple(
            (tuple(s.edges), s.arrivalPos) if s.type == WALKING else ((), s.travelTime)
            for s in stages
        ),
    )


class Departures:
    """A demand being sent again, each body when its time has come.

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
        """Let go who departs in the timestep that comes next; call before each."""
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
        """Put them back; static programs then run as they did."""
        for name, phase, left in self._first:
            self._lights.setPhase(name, phase)
            self._lights.setPhaseDuration(name, left)
