"""The observation of a learning ego: one flat vector of numbers, in its own frame.

============================ ====== ============================================================
entry                        unit   meaning
============================ ====== ============================================================
``ego.speed_mps``            m/s    its speed
``ego.steering_rad``         rad    its steering angle, positive to the left
``ego.left_m``               m      length of its path ahead of its front
``ego.beside_m``             m      how far its centre is beside the path, positive to the left
``ego.turned_rad``           rad    its heading relative to the path, positive to the left
``pathD.y_m``                m      how far to its left the path lies D metres on (5, 10, 20, 40)
``pathD.turn_rad``           rad    heading of the path there relative to its own
``lightC``                   1      1 if the next traffic light ahead shows red, yellow or green
``light.ahead_m``            m      from its front to the stop line of that light
``bodyK.present``            1      1 if there is a K-th nearest body within 80 m, else 0
``bodyK.x_m``, ``bodyK.y_m`` m      its centre, ahead of and to the left of the ego's centre
``bodyK.vx_mps``, ``.vy_mps`` m/s   its velocity over ground, ahead and to the left
``bodyK.length_m``           m      the length of its box
``bodyK.width_m``            m      the width of its box
============================ ====== ============================================================

Bodies are testers and background traffic alike, six of them, the nearest first. Every entry is
clipped to its bounds. Entries of missing bodies and lights are 0, except the distance of a light,
which is its upper bound.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from cavsumo.model.bodies import Kind
from cavsumo.model.kinematics import wrap
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import RawState, Snapshot

VERSION = 1  # changes with the meaning of any entry
AHEAD_M = (5.0, 10.0, 20.0, 40.0)  # distances of the points of the path ahead
BODIES = 6
FAR_M, BESIDE_M, SIGHT_M, BODY_SPEED = 100.0, 20.0, 80.0, 30.0  # bounds of the entries
LENGTH_M, WIDTH_M = 20.0, 5.0
COLOURS = {"red": "ru", "yellow": "yY", "green": "gG"}  # the letters in which SUMO shows them

Bounds = tuple[str, float, float]


def entries(kind: Kind) -> tuple[Bounds, ...]:
    """Name, lower and upper bound of every entry, for an ego of that kind."""
    body = (
        ("present", 0.0, 1.0),
        ("x_m", -SIGHT_M, SIGHT_M),
        ("y_m", -SIGHT_M, SIGHT_M),
        ("vx_mps", -BODY_SPEED, BODY_SPEED),
        ("vy_mps", -BODY_SPEED, BODY_SPEED),
        ("length_m", 0.0, LENGTH_M),
        ("width_m", 0.0, WIDTH_M),
    )
    path = (("y_m", -FAR_M, FAR_M), ("turn_rad", -math.pi, math.pi))
    return (
        ("ego.speed_mps", kind.v_min, kind.v_max),
        ("ego.steering_rad", -kind.steering_max, kind.steering_max),
        ("ego.left_m", 0.0, FAR_M),
        ("ego.beside_m", -BESIDE_M, BESIDE_M),
        ("ego.turned_rad", -math.pi, math.pi),
        *((f"path{d:g}.{name}", low, high) for d in AHEAD_M for name, low, high in path),
        *((f"light.{colour}", 0.0, 1.0) for colour in COLOURS),
        ("light.ahead_m", 0.0, FAR_M),
        *((f"body{k}.{name}", low, high) for k in range(BODIES) for name, low, high in body),
    )


class EgoObserver:
    """The observations of one episode for the ego; made anew at each reset."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._bounds = [(low, high) for _, low, high in entries(scene.ego.kind)]
        self._half = scene.ego.kind.length / 2

    def vector(self, snapshot: Snapshot) -> NDArray[np.float32]:
        """The ego's observation of a snapshot: float32 of shape (number of entries,)."""
        bounded = [
            low if value < low else high if value > high else value
            for value, (low, high) in zip(self._values(snapshot), self._bounds, strict=True)
        ]
        return np.array(bounded, dtype=np.float32)

    def _values(self, snapshot: Snapshot) -> Iterator[float]:
        """The entries before they are clipped."""
        ego, path = snapshot.ego, self._scene.ego_path
        here = self._scene.ego_projection(snapshot)
        cos, sin = math.cos(ego.o), math.sin(ego.o)
        yield ego.v
        yield snapshot.ego_steering
        yield path.length - here.along - self._half
        yield here.lateral
        yield wrap(ego.o - path.at(here.along)[2])
        for distance in AHEAD_M:
            x, y, heading = path.at(here.along + distance)
            yield (y - ego.y) * cos - (x - ego.x) * sin
            yield wrap(heading - ego.o)
        yield from self._light(snapshot, here.along + self._half)
        yield from self._bodies(snapshot, cos, sin)

    def _light(self, snapshot: Snapshot, front: float) -> tuple[float, ...]:
        """The next traffic light whose stop line is still ahead."""
        for light, letter in zip(self._scene.lights, snapshot.lights, strict=False):
            if light.along >= front:
                shown = [float(letter in letters) for letters in COLOURS.values()]
                return (*shown, light.along - front)
        return (*(0.0 for _ in COLOURS), FAR_M)

    def _bodies(self, snapshot: Snapshot, cos: float, sin: float) -> Iterator[float]:
        """The nearest bodies in the ego's frame."""
        _, ex, ey, _, _ = snapshot.ego

        def square(state: RawState) -> float:
            return (state[1] - ex) ** 2 + (state[2] - ey) ** 2

        everybody = [s for s in (*snapshot.testers, *snapshot.raw_background)]
        near = [s for s in everybody if square(s) <= SIGHT_M * SIGHT_M]
        nearest = heapq.nsmallest(BODIES, near, key=square)
        for body, x, y, v, o in nearest:
            dx, dy, turn = x - ex, y - ey, o - snapshot.ego.o
            yield 1.0
            yield dx * cos + dy * sin
            yield dy * cos - dx * sin
            yield v * math.cos(turn)
            yield v * math.sin(turn)
            yield body.kind.length
            yield body.kind.width
        yield from [0.0] * (7 * (BODIES - len(nearest)))
