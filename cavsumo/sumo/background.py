"""The background traffic, read from SUMO only when it may touch the ego or a tester.

Reading a body costs as much as all computations with it, and most bodies are far from the ego and
the testers. Unless all bodies are required (``everything``), a body is therefore read again only
when it may have come within touch of a *watcher*, the ego or a tester.

The bound. Let P be the middle of a body's front edge, the point that SUMO moves. No point of its
box is farther from P than f = sqrt(length^2 + (width / 2)^2), and no point of a watcher's box
farther from its centre than its reach r. At a reading, let g be the smallest ``|P - centre| - r``
over all watchers, less f. From then on

* P moves by at most ``stride = top speed * timestep * stretch + leap`` in a timestep. In SUMO no
  body exceeds the type's maxSpeed. ``stretch`` is the largest ratio of a lane's drawn length to the
  length that SUMO drives, ``leap`` the largest gap between the ends of two linked lanes plus the
  widest lane: SUMO changes lanes, and corners, in one timestep (see ``Roaming``);
* no watcher moves by more than the way that was *measured* in that timestep, the longest of all.

As long as the sum over the timesteps of stride and measured way stays below g, the boxes are apart,
for any turns. That sum is a lookout's odometer. Pedestrians must see others before they touch them,
so bodies that may be within AROUND_M of a watcher are read too: g is less by that. Bodies for which
the bound does not hold are read in every timestep: those with stops or rides ahead (they park,
board, jump), and persons if the network has no walking areas (they jump over junctions). A body
found farther from its last place than the bound allows raises a SimulationError.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

from cavsumo.errors import SimulationError
from cavsumo.model.bodies import Body, Kind
from cavsumo.model.snapshot import AROUND_M, BodyState, RawState
from cavsumo.sumo.calls import direct
from cavsumo.sumo.poses import RADIANS

ROUNDING_M = 1e-6  # added to every stride; far above the rounding of any coordinate
WALKING_AREA = re.compile(r"^:.*_w\d+_\d+$")  # ids of their lanes, whose shapes are outlines
WALKING = 2  # SUMO's number of the stage in which a person walks


class Roaming(NamedTuple):
    """Bounds on the distance that a body moves beyond its speed on a network.

    Attributes:
        stretch: drawn metres for a metre driven, at least 1.
        leap: metres that may be jumped in one timestep.
        walkable: whether persons walk across junctions instead of jumping over them.
    """

    stretch: float = 1.0
    leap: float = 0.0
    walkable: bool = True


def roaming(lane: Any) -> Roaming:
    """Measure a network through SUMO's domain of lanes."""
    names = lane.getIDList()
    shapes = {name: lane.getShape(name) for name in names if not WALKING_AREA.match(name)}
    stretch, gap = 1.0, 0.0
    for name, shape in shapes.items():
        drawn = sum(math.dist(a, b) for a, b in pairwise(shape))
        stretch = max(stretch, drawn / lane.getLength(name))
        for link in lane.getLinks(name):
            following = shapes.get(link[4] or link[0])  # by way of the junction, if it has one
            if following is not None:
                gap = max(gap, math.dist(shape[-1], following[0]))
    widest = max(map(lane.getWidth, names), default=0.0)
    return Roaming(stretch, gap + widest, len(shapes) < len(names))


class Background:
    """All bodies but the watchers, in one episode.

    Args:
        vehicles, persons: SUMO's two domains.
        roaming: of the network; None reads all bodies in every timestep.
        dt: length of a timestep [s].
        watchers: the ego and the testers as they are now.
    """

    def __init__(
        self,
        vehicles: Any,
        persons: Any,
        roaming: Roaming | None,
        dt: float,
        watchers: Sequence[BodyState],
    ) -> None:
        mine = frozenset(w.body.id for w in watchers)
        self._watchers = watchers
        self._vehicles = Lookout(
            vehicles, mine, dt, roaming, lambda i: bool(vehicles.getStops(i, 1))
        )
        self._persons = Lookout(persons, mine, dt, roaming, lambda i: _rides(persons, i, roaming))

    def read(
        self, vehicles: tuple[str, ...], persons: tuple[str, ...], watchers: Sequence[BodyState]
    ) -> tuple[RawState, ...]:
        """All bodies, or at least those that may touch a watcher now; called in every timestep.

        Args:
            vehicles, persons: the ids of all in SUMO.
            watchers: the ego and the testers, always in the same order.
        """
        way = 0.0  # the longest that any watcher made
        for before, now in zip(self._watchers, watchers, strict=True):
            if before is not now:
                way = max(way, math.hypot(now.x - before.x, now.y - before.y))
        self._watchers = watchers
        driving = self._vehicles.read(vehicles, way, watchers)
        walking = self._persons.read(persons, way, watchers)
        return (*driving, *walking) if driving or walking else ()


class Sighting:
    """One background body, and when to read it again.

    Attributes:
        body: the body.
        half: half its length [m].
        forward: largest distance of a point of its box from the middle of its front edge [m].
        tame: whether the bound of the module holds for it.
        due: the reading of the lookout's odometer from which on it may touch a watcher [m].
        x, y, step: where and when its front was last read.
        angle, o: its direction when that was last read, as SUMO has it [deg] and as we do [rad].
        front_x, front_y: from its centre to the middle of its front edge then [m].
    """

    __slots__ = tuple("angle body due forward front_x front_y half o step tame x y".split())

    def __init__(self, body: Body, tame: bool) -> None:
        self.body, self.tame = body, tame
        self.half = body.kind.length / 2
        self.forward = math.hypot(body.kind.length, body.kind.width / 2)
        self.due = -math.inf
        self.x = self.y = 0.0
        self.step = -1
        self.turn(0.0)

    def turn(self, angle: float) -> None:
        """Take in its direction [deg]; most bodies go straight on, and keep it."""
        self.angle = angle
        o = (90.0 - angle) * RADIANS
        self.o = o + 2 * math.pi if o <= -math.pi else o
        self.front_x, self.front_y = self.half * math.cos(self.o), self.half * math.sin(self.o)


class Lookout:
    """The background bodies of one of SUMO's domains; the odometer and the bound are the module's.

    Args:
        restless: whether the bound does not hold for the body of that id.
    """

    def __init__(
        self,
        domain: Any,
        mine: frozenset[str],
        dt: float,
        roaming: Roaming | None,
        restless: Callable[[str], bool],
    ) -> None:
        self._domain, self._mine, self._dt, self._restless = domain, mine, dt, restless
        self._position = direct(domain, "getPosition")
        self._angle, self._speed = direct(domain, "getAngle"), direct(domain, "getSpeed")
        self._everything = roaming is None
        self._roaming = roaming or Roaming()
        self._ids: tuple[str, ...] = ()
        self._known: dict[str, Sighting] = {}
        self._others: list[Sighting] = []
        self._stride = ROUNDING_M + self._roaming.leap  # of the fastest that was met [m]
        self._step, self._odometer, self._due = 0, 0.0, math.inf

    def read(
        self, ids: tuple[str, ...], way: float, watchers: Sequence[BodyState]
    ) -> list[RawState]:
        """The bodies that may touch a watcher now, or all, in the order of their ids."""
        self._step += 1
        self._odometer += self._stride + way
        if ids != self._ids:
            self._muster(ids)
        if self._everything:
            return self._looked(self._others)
        if self._odometer < self._due:
            return []
        now, due = self._odometer, math.inf
        near = []
        for other in self._others:
            if other.due <= now and self._near(other, watchers):
                near.append(other)
            if other.due < due:
                due = other.due
        self._due = due
        return self._looked(near)

    def _muster(self, ids: tuple[str, ...]) -> None:
        """Register new bodies, which are read at once, and remove those that left."""
        self._ids = ids
        known = self._known
        self._known = {i: known.get(i) or self._meet(i) for i in ids if i not in self._mine}
        self._others = list(self._known.values())
        self._due = -math.inf

    def _meet(self, body_id: str) -> Sighting:
        """A body seen for the first time."""
        domain = self._domain
        length, width = domain.getLength(body_id), domain.getWidth(body_id)
        kind = _kind(str(domain.getVehicleClass(body_id)), length, width)
        if not self._everything:
            roaming, top = self._roaming, domain.getMaxSpeed(body_id)
            stride = top * self._dt * roaming.stretch + roaming.leap + ROUNDING_M
            self._stride = max(self._stride, stride)
        return Sighting(Body(body_id, kind), self._everything or not self._restless(body_id))

    def _near(self, other: Sighting, watchers: Sequence[BodyState]) -> bool:
        """Read a body: whether it may touch a watcher now, and if not, when to read it next."""
        x, y = self._position(other.body.id)
        gap, hypot = math.inf, math.hypot
        for body, there_x, there_y, _, _ in watchers:
            distance = hypot(x - there_x, y - there_y) - body.kind.reach
            if distance < gap:
                gap = distance
        gap -= other.forward + AROUND_M
        if other.tame:
            self._check(other, x, y)
            other.x, other.y, other.step = x, y, self._step
            other.due = self._odometer + gap if gap > 0.0 else self._odometer
        return gap <= ROUNDING_M

    def _check(self, other: Sighting, x: float, y: float) -> None:
        """Raise SimulationError if a body is farther from where it was than the bound allows."""
        if other.step >= 0:
            way, steps = math.hypot(x - other.x, y - other.y), self._step - other.step
            if way > steps * self._stride:
                name = other.body.id
                raise SimulationError(f"{name} jumped: {way:.1f} m in {steps} timesteps")

    def _looked(self, others: Sequence[Sighting]) -> list[RawState]:
        """The states of bodies as SUMO has them."""
        # from_sumo, written out: with everything read this is the innermost loop of a timestep
        position, angle, speed = self._position, self._angle, self._speed
        found = []
        for other in others:
            body = other.body
            name = body.id
            x, y = position(name)
            turned = angle(name)
            if turned != other.angle:
                other.turn(turned)
            found.append((body, x - other.front_x, y - other.front_y, speed(name), other.o))
        return found


@lru_cache(maxsize=1000)
def _kind(name: str, length: float, width: float) -> Kind:
    """The kind of a background body; there are few, and many bodies."""
    return Kind(name, length, width, 2 * length / 3, 0.0, math.inf, -math.inf, math.inf, 0.0)


def _rides(persons: Any, body_id: str, roaming: Roaming | None) -> bool:
    """Whether a person does more than walk, or walks on a network where persons jump."""
    if roaming is None or not roaming.walkable:
        return True
    left = range(persons.getRemainingStages(body_id))
    return any(persons.getStage(body_id, i).type != WALKING for i in left)
