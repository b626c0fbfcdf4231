"""The departures of the background traffic, noted while SUMO carries out a demand."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cavsumo.errors import InputError
from cavsumo.model.departures import Attributes, Demand, Entry, Stage, Trip, Walk

WALKING = 2  # SUMO's number of the stage in which a person walks
WAITING = 1  # and in which one waits


class DepartureNotes:
    """Departures so far in a simulation.

    Args:
        types: of the demand.
        apart: ids of those who are no background.
        ego: the ego's entry, if it is another one than that of its route.
    """

    def __init__(
        self, types: Mapping[str, Attributes], apart: frozenset[str], ego: Entry | None = None
    ) -> None:
        self._types, self._apart, self._ego = types, apart, ego
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
        return Demand(tuple(self._trips), tuple(self._walks), types, self._ego)


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
            raise InputError(f"person {name!r} rides; only walks can be recorded")
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
