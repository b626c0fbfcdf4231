"""Departures of the background traffic: who entered when, where and how fast, and goes where.

They are what SUMO made of a demand (flows, random places, speed factors), so that the same traffic
can be sent again without it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

Attributes = Mapping[str, str]  # of a vehicle type, as SUMO's files name them


class Trip(NamedTuple):
    """The departure of a vehicle."""

    time: float  # s since the beginning of the simulation
    id: str
    type: str
    edges: tuple[str, ...]
    lane: int
    along: float  # m
    speed: float  # m/s
    factor: float  # what its driver makes of speed limits


class Stage(NamedTuple):
    """A part of a person's plan: a walk along edges, or with none a wait."""

    edges: tuple[str, ...]
    end: float  # where the walk ends on the last edge [m], or how long the wait lasts [s]


class Walk(NamedTuple):
    """The departure of a person."""

    time: float  # s since the beginning of the simulation
    id: str
    type: str
    edge: str
    along: float  # m
    factor: float  # of the type's walking speed
    stages: tuple[Stage, ...]


class Entry(NamedTuple):
    """Another entry of the ego than that of its route."""

    edge: int  # which edge of its route it enters on
    lane: int
    along: float  # place of its front bumper on the lane [m]
    speed: float  # m/s


@dataclass(frozen=True)
class Demand:
    """Departures in the order of their times.

    Attributes:
        trips, walks: of vehicles and of persons.
        types: attributes of their vehicle types, by id; without those that SUMO knows by itself or
            from additional files.
        ego: where and how fast the ego enters, if not at the beginning of its route.
    """

    trips: tuple[Trip, ...] = ()
    walks: tuple[Walk, ...] = ()
    types: Mapping[str, Attributes] = field(default_factory=dict)
    ego: Entry | None = None
