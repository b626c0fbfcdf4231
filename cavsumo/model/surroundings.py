"""The lanes and pavements near the ego's route, for egos that plan their path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

Points = tuple[tuple[float, float], ...]


class RouteLane(NamedTuple):
    """A lane of the ego's route, until the next one.

    Attributes:
        along: arc length on the ego's path at which it begins [m].
        width: [m].
        speed: its speed limit [m/s].
    """

    along: float
    width: float
    speed: float


class LaneBorders(NamedTuple):
    """The borders of a lane for cars, in its direction.

    Attributes:
        id: of the lane in the network.
        left, right: points of the borders [m].
    """

    id: str
    left: Points
    right: Points


@dataclass(frozen=True)
class Surroundings:
    """The road near the ego's route.

    Attributes:
        route: the lanes of the route, in order.
        lanes: the lanes for cars near it, those inside junctions only if they are on the route.
        pavements: outlines of the pavements, footpaths and waiting areas near it [m].
    """

    route: tuple[RouteLane, ...] = ()
    lanes: tuple[LaneBorders, ...] = ()
    pavements: tuple[Points, ...] = ()
