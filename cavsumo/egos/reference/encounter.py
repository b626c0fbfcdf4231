"""Position and motion of a body relative to the ego's way, at one timestep.

The ego is assumed to follow its path; its *strip* is the area that its width sweeps. Everything is
measured along the path and across it; a body counts with the extent of its turned box.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from cavsumo.agents.driving import BESIDE_M, extent
from cavsumo.assertions.contacts import STANDING_MPS
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

SIGHT_M = 100.0  # how far ahead a driver looks
EVALUATION_S = 0.4  # a driver ignores a conflict that ends sooner


class Encounter(NamedTuple):
    """The ego and one other body relative to the ego's path.

    Attributes:
        gap: from the ego's front to the nearest point of the body, along the path; negative beside
            the ego and behind it [m].
        length: along the path, of the body and the ego together [m].
        beside: from the strip to the body; negative inside the strip [m].
        width: across the path, of the body and the strip together [m].
        speed: of the ego [m/s].
        onward: speed of the body along the path [m/s].
        inward: speed of the body across the path, positive towards its middle [m/s].
        on_road: whether the body's centre is on a carriageway, or the body in the strip.
    """

    gap: float
    length: float
    beside: float
    width: float
    speed: float
    onward: float
    inward: float
    on_road: bool

    @property
    def conflict(self) -> bool:
        """Whether both touch if they keep their velocities, and a driver can see it coming.

        The body is on the carriageway, not beside it, and no farther ahead than ``SIGHT_M``. For a
        standing ego every body in its strip is a conflict: it need not set off.
        """
        if not self.on_road or self.gap > SIGHT_M or self.gap <= -self.length:
            return False
        if self.speed <= STANDING_MPS and self.beside < 0.0:
            return True
        reach, past = _spell(self.gap, self.length, self.speed - self.onward)
        enter, leave = _spell(self.beside, self.width, self.inward)
        return max(reach, enter) < min(past, leave)

    @property
    def in_way(self) -> bool:
        """Whether the body blocks the ego's way at present, and the ego comes nearer.

        That is in the strip, or on the carriageway with less than ``BESIDE_M`` between them.
        """
        ahead = -self.length < self.gap <= SIGHT_M
        return self.on_road and self.beside < BESIDE_M and ahead and self.speed > self.onward


def _spell(distance: float, length: float, speed: float) -> tuple[float, float]:
    """Begin and end of the overlap of two intervals that close at a constant speed [s].

    ``distance`` is between them, negative once they overlap; ``length`` is that of both together.
    """
    if speed == 0.0:
        return (0.0, math.inf) if distance < 0.0 else (math.inf, math.inf)
    times = sorted((distance / speed, (distance + length) / speed))
    return max(0.0, times[0]), times[1]


def encounter(scene: Scene, snapshot: Snapshot, body: BodyState) -> Encounter:
    """The encounter of the ego with a body in a snapshot."""
    ego, path = snapshot.ego, scene.ego_path
    here, front = path.project(body.x, body.y), path.project(ego.x, ego.y).along
    front += ego.body.kind.length / 2
    axis = path.at(here.along)[2]
    turn = body.o - axis
    along, across = extent(body, axis)
    half = ego.body.kind.width / 2
    beside = abs(here.lateral) - across - half
    roads = scene.roads
    return Encounter(
        gap=here.along - along - front,
        length=2 * along + ego.body.kind.length,
        beside=beside,
        width=2 * across + 2 * half,
        speed=ego.v,
        onward=body.v * math.cos(turn),
        inward=-math.copysign(1.0, here.lateral) * body.v * math.sin(turn),
        on_road=beside < 0.0 or roads is None or roads.contains(body.x, body.y),
    )


def lasting_conflict(encounters: Sequence[Encounter | None], dt: float) -> int | None:
    """The timestep at which the risk began that lasts until the end; None without one.

    A risk is a conflict, or a body in the way: the body may stay there, so a driver does not wait
    for a velocity that leads to a touch. A driver perceives it if it lasts for ``EVALUATION_S``, or
    until the end. It has ended when there has been none for that time.
    """
    alarm = began = ceased = None
    for step, met in enumerate(encounters):
        if met is not None and (met.conflict or met.in_way):
            began, ceased = step if began is None else began, None
            if alarm is None and _lasts(began, step, dt):
                alarm = began
        else:
            began, ceased = None, step if ceased is None else ceased
            if _lasts(ceased, step, dt):
                alarm = None
    return began if alarm is None else alarm


def _lasts(since: int, step: int, dt: float) -> bool:
    """Whether it has lasted for the time that a driver needs to evaluate it."""
    return (step - since) * dt >= EVALUATION_S - 1e-9
