"""Carriageways, and the ways across and along them, on any road of any network.

Pure geometry (shapely): built from polygons and lane axes, knows neither files nor SUMO.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import shapely
from shapely.geometry import LineString, Point

from cavsumo.model.cells import Cells
from cavsumo.model.polyline import Path

REACH_M = 60.0  # how far a crossing line is followed; wider carriageways are not crossed
ISLAND_M = 1.5  # traffic islands narrower than this are walked over
BEYOND_M = 1.0  # how far past the far kerb a body walks that starts on the carriageway


@dataclass(frozen=True, slots=True)
class Crossing:
    """A straight way across the carriageway.

    Attributes:
        x, y: where it starts [m].
        heading: its direction [rad].
        enter, leave: distances from the start to the near and the far edge of the carriageway [m].
        length: where the way ends: as far beyond the far edge as it began before the near one,
            CAV-Gym's mirror point [m].
    """

    x: float
    y: float
    heading: float
    enter: float
    leave: float
    length: float
    _cos: float = field(init=False, repr=False)
    _sin: float = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_cos", math.cos(self.heading))
        object.__setattr__(self, "_sin", math.sin(self.heading))

    def progress(self, x: float, y: float) -> float:
        """How far along the way a point is [m]."""
        return (x - self.x) * self._cos + (y - self.y) * self._sin


class Light(NamedTuple):
    """A traffic light on the ego's way.

    Attributes:
        id: of the traffic light in the network.
        link: index of the ego's link in the letters that it shows.
        along: arc length of the stop line on the ego's path [m].
    """

    id: str
    link: int
    along: float


@dataclass(frozen=True, slots=True, eq=False)
class MarkedCrossing:
    """A marked pedestrian crossing on the ego's way.

    Attributes:
        id: of the crossing in the network.
        begin, end: where the ego's path enters and leaves its surface [m].
        surface: the crossing.
        light: id of the traffic light that controls it, and the index of its letter for pedestrians
            there; None without.
        priority: whether pedestrians on it have priority, as on a zebra crossing.
    """

    id: str
    begin: float
    end: float
    surface: shapely.Geometry
    light: tuple[str, int] | None
    priority: bool

    @property
    def signalled(self) -> bool:
        """Whether a traffic light controls it."""
        return self.light is not None


class Limit(NamedTuple):
    """A speed limit on the ego's way, until the next one.

    Attributes:
        along: arc length on the ego's path from which it holds [m].
        speed: [m/s].
    """

    along: float
    speed: float


@dataclass(frozen=True, slots=True, eq=False)
class Approach:
    """A way along lanes on which a vehicle can meet the ego.

    Arc lengths are those of the centre of a body that follows the path [m].

    Attributes:
        type: a ``vocabulary.ApproachType``.
        path: centre line of its lanes, through the junction and on.
        edges: ids of the edges along it.
        wait: where a body waits that gives way; infinite if it need not wait.
        enter, leave: where a body begins to touch the strip that the ego sweeps, and where it
            no longer does (infinite if it stays); beside the ego's lane, where the lanes begin
            and cease to run side by side.
        ego_enter: arc length on the ego's path at which it would touch a body that enters.
        yields: whether traffic rules or lights require it to give way to the ego.
        speed, ego_speed: speed limits on the ways to there, its own and the ego's [m/s].
        into: for a lane beside the ego's, the ego's own lane and on.
    """

    type: str
    path: Path
    edges: tuple[str, ...]
    wait: float
    enter: float
    leave: float
    ego_enter: float
    yields: bool
    speed: float
    ego_speed: float
    into: Path | None = None


@dataclass(frozen=True, slots=True)
class Start:
    """Where a tester's body starts, and the pavement it stands on or the way it drives.

    Attributes:
        x, y, o: position [m] and orientation [rad].
        pavement: axis of the pavement, or None away from any.
        lateral: offset from that axis, positive to its left [m].
        forwards: whether the body faces along the axis (True) or against it.
        walk: ids of edges along which SUMO may believe a person here to walk.
        approach: the way that a vehicle drives, None for a pedestrian.
        v: speed [m/s]; None leaves it to the scenario.
    """

    x: float
    y: float
    o: float
    pavement: Path | None = None
    lateral: float = 0.0
    forwards: bool = True
    walk: tuple[str, ...] = ()
    approach: Approach | None = None
    v: float | None = None


class StartRecord(NamedTuple):
    """A start as plain data; what belongs to the site is named by its number there.

    Attributes:
        x, y, o, v: as of a Start.
        place: number of the site's area that the body starts on, or of the approach that it drives
            on; None for neither.
        lateral, forwards: as of a Start.
        edges: of the walk or of the approach, by which the place is known again.
    """

    x: float
    y: float
    o: float
    v: float | None = None
    place: int | None = None
    lateral: float = 0.0
    forwards: bool = True
    edges: tuple[str, ...] = ()


class Roads:
    """The carriageways of a network.

    Args:
        carriageway: the union of all lanes for vehicles, junctions included.
        lanes: axes of the lanes for vehicles outside junctions; they give a road its direction.
        pavements: axes of the pavements and footpaths.
    """

    def __init__(
        self,
        carriageway: shapely.Geometry,
        lanes: Sequence[LineString],
        pavements: Sequence[LineString] = (),
    ) -> None:
        self.carriageway = carriageway
        self.lanes = list(lanes)
        self.pavements = shapely.MultiLineString(list(pavements))
        self._index = shapely.STRtree(self.lanes)
        self._boundary = carriageway.boundary
        shapely.prepare(self.carriageway)
        shapely.prepare(self._boundary)
        shapely.prepare(self.pavements)
        self.on_carriageway = Cells(self.contains, self.edge_distance)
        self._worlds: dict[tuple[float, bool], Cells] = {}

    def __reduce__(self) -> tuple[type[Roads], tuple[Any, ...]]:
        return Roads, (self.carriageway, self.lanes, list(self.pavements.geoms))

    def contains(self, x: float, y: float) -> bool:
        """Whether a point lies on the carriageway."""
        return bool(shapely.contains_xy(self.carriageway, x, y))

    def within(self, reach: float, *, on_foot: bool) -> Cells:
        """Whether points are within a reach [m] of a carriageway, ``on_foot`` or of a pavement."""
        if (reach, on_foot) not in self._worlds:
            far = self.walking_distance if on_foot else self.driving_distance
            self._worlds[reach, on_foot] = Cells(
                lambda x, y: far(x, y) <= reach, lambda x, y: abs(far(x, y) - reach)
            )
        return self._worlds[reach, on_foot]

    def edge_distance(self, x: float, y: float) -> float:
        """Distance to the nearest edge of a carriageway [m]."""
        return float(shapely.distance(self._boundary, Point(x, y)))

    def driving_distance(self, x: float, y: float) -> float:
        """Distance to the carriageway [m], 0 on it."""
        return 0.0 if self.contains(x, y) else self.edge_distance(x, y)

    def walking_distance(self, x: float, y: float) -> float:
        """Distance to the nearest carriageway or axis of a pavement [m], 0 on a carriageway."""
        road = self.driving_distance(x, y)
        if self.pavements.is_empty:
            return road
        return min(road, float(shapely.distance(self.pavements, Point(x, y))))

    def crossing(self, x: float, y: float) -> Crossing | None:
        """The way straight across the nearest road from a point, or None where there is none."""
        here = Point(x, y)
        lane = self.lanes[int(self._index.nearest(here))]
        heading = _across(lane, here)
        ray = LineString(
            [(x, y), (x + REACH_M * math.cos(heading), y + REACH_M * math.sin(heading))]
        )
        span = _first_span(x, y, shapely.intersection(ray, self.carriageway))
        if span is None:
            return None
        enter, leave = span
        beyond = enter if enter > 0.01 else BEYOND_M
        return Crossing(x, y, heading, enter, leave, leave + beyond)


def _across(lane: LineString, here: Point) -> float:
    """Heading at right angles to a lane, from a point towards it."""
    along = lane.project(here)
    step = min(0.5, lane.length / 4)
    a = lane.interpolate(max(0.0, along - step))
    b = lane.interpolate(min(lane.length, along + step))
    tangent = math.atan2(b.y - a.y, b.x - a.x)
    nearest = lane.interpolate(along)
    left = math.cos(tangent) * (here.y - nearest.y) - math.sin(tangent) * (here.x - nearest.x) > 0
    turn = -math.pi / 2 if left else math.pi / 2
    return math.atan2(math.sin(tangent + turn), math.cos(tangent + turn))


def _first_span(x: float, y: float, cut: shapely.Geometry) -> tuple[float, float] | None:
    """Distances from a point at which a ray from there enters and leaves the first carriageway."""
    spans = sorted(
        (min(ds), max(ds))
        for part in getattr(cut, "geoms", [cut])
        if part.geom_type == "LineString" and not part.is_empty
        for ds in [[math.sqrt((px - x) * (px - x) + (py - y) * (py - y)) for px, py in part.coords]]
    )
    if not spans:
        return None
    enter, leave = spans[0]
    for low, high in spans[1:]:
        if low - leave > ISLAND_M:
            break
        leave = max(leave, high)
    return enter, leave
