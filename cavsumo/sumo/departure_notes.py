"""The departures of the background traffic, noted while SUMO carries out a demand."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cavsumo.errors import InputError
from cavsumo.model.departures import Attributes, Demand, Entry, Stage, Trip, Walk
from cavsumo.sumo.calls import direct

WALKING = 2  # SUMO's number of the stage in which a person walks
WAITING = 1  # and in which one waits


class DepartureNotes:
    """Departures so far in a simulation.

    Args:
        sumo: SUMO's functions.
        types: of the demand.
        apart: ids of those who are no background.
        dt: length of a timestep [s].
        ego: the ego's entry, if it is another one than that of its route.
    """

    def __init__(
        self,
        sumo: Any,
        types: Mapping[str, Attributes],
        apart: frozenset[str],
        dt: float,
        ego: Entry | None = None,
    ) -> None:
        self._sumo, self._types, self._apart, self._dt = sumo, types, apart, dt
        self._ego = ego
        self._vehicles = direct(sumo.simulation, "getDepartedIDList")
        self._persons = direct(sumo.simulation, "getDepartedPersonIDList")
        self._trips: list[Trip] = []
        self._walks: list[Walk] = []

    def add(self) -> None:
        """Note who departed in the last timestep."""
        vehicles, persons = self._vehicles(), self._persons()
        if not vehicles and not persons:
            return
        begun = round(self._sumo.simulation.getTime() - self._dt, 3)  # SUMO counts milliseconds
        for name in vehicles:
            if name not in self._apart:
                self._trips.append(_trip(self._sumo.vehicle, begun, name))
        for name in persons:
            if name not in self._apart:
                self._walks.append(_walk(self._sumo.person, begun, name))

    def demand(self) -> Demand:
        """All of them, with the types that they are of."""
        used = {trip.type for trip in self._trips} | {walk.type for walk in self._walks}
        types = {name: type_ for name, type_ in self._types.items() if name in used}
        return Demand(tuple(self._trips), tuple(self._walks), types, self._ego)


def _trip(vehicle: Any, time: float, name: str) -> Trip:
    """A vehicle that has departed at a time [s]."""
    return Trip(
        time,
        name,
        vehicle.getTypeID(name),
        tuple(vehicle.getRoute(name)),
        vehicle.getLaneIndex(name),
        vehicle.getLanePosition(name),
        vehicle.getSpeed(name),
        vehicle.getSpeedFactor(name),
    )


def _walk(person: Any, time: float, name: str) -> Walk:
    """A person that has departed at a time [s]; raises InputError unless it walks and waits."""
    stages = [person.getStage(name, i) for i in range(person.getRemainingStages(name))]
    for stage in stages:
        if stage.type not in (WALKING, WAITING):
            raise InputError(f"person {name!r} rides; only walks can be recorded")
    return Walk(
        time,
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
