"""Positions and speeds of other bodies relative to the ego's path: ahead, aside, onward, sideways.

The ego's way is the strip of its width along its path, so a body beside a curve is not in front of
the ego. Cheap tests come first, because most bodies are far.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from cavsumo.model.geometry import corners
from cavsumo.model.polyline import Path
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot


class Relation(NamedTuple):
    """A body as seen from the ego, along its path."""

    body: BodyState
    ahead: float  # from the ego's front bumper to the body; 0 or less beside the ego [m]
    aside: float  # from the ego's strip to the body, 0 in the ego's way [m]
    left: bool  # whether its centre is to the left of the path
    onward: float  # its speed along the path, positive the ego's way [m/s]
    sideways: float  # its speed across the path, positive towards the strip [m/s]

    @property
    def in_way(self) -> bool:
        """Whether it reaches into the ego's way."""
        return self.aside <= 0.0


def everybody(snapshot: Snapshot) -> Iterator[BodyState]:
    """The testers and the background."""
    yield from snapshot.testers
    yield from snapshot.background


def front_along(scene: Scene, snapshot: Snapshot) -> float:
    """Arc length of the ego's front bumper on its path [m]."""
    return scene.ego_progress(snapshot) + snapshot.ego.body.kind.length / 2


def relations(scene: Scene, snapshot: Snapshot, within: float) -> Iterator[Relation]:
    """All bodies within a distance of the ego that are not behind it [m]."""
    ego = snapshot.ego
    far = within + ego.body.kind.reach
    rear = front_along(scene, snapshot) - ego.body.kind.length
    for body in everybody(snapshot):
        reach = far + body.body.kind.reach
        # For a turning ego a body ahead on its path may be beside it, so no body is left out by
        # direction.
        if abs(body.x - ego.x) > reach or abs(body.y - ego.y) > reach:
            continue
        found = relation(scene, snapshot, body)
        if found.ahead + body.body.kind.reach * 2 >= rear - front_along(scene, snapshot):
            yield found


def relation(scene: Scene, snapshot: Snapshot, body: BodyState) -> Relation:
    """The relation of one body to the ego."""
    path, half = scene.ego_path, snapshot.ego.body.kind.width / 2
    middle, left = _placed(path, body.x, body.y)
    ends = [_placed(path, x, y) for x, y in corners(body.box)]
    lateral = [aside for _, aside in ends]
    turned = body.o - path.at(middle)[2]
    across = body.v * math.sin(turned)
    return Relation(
        body,
        min(along for along, _ in ends) - front_along(scene, snapshot),
        max(0.0, min(lateral) - half, -max(lateral) - half),
        left > 0.0,
        body.v * math.cos(turned),
        -across if left > 0.0 else across,
    )


def _placed(path: Path, x: float, y: float) -> tuple[float, float]:
    """Arc length of a point and its distance to the left, the path prolonged straight [m]."""
    along, lateral, _ = path.project(x, y)
    if 0.0 < along < path.length:
        return along, lateral
    x0, y0, o = path.at(along)
    dx, dy, c, s = x - x0, y - y0, math.cos(o), math.sin(o)
    return along + dx * c + dy * s, dy * c - dx * s


def in_way(scene: Scene, snapshot: Snapshot, within: float) -> Iterator[Relation]:
    """The bodies in the ego's way ahead of it within a distance [m]."""
    for found in relations(scene, snapshot, within):
        if found.in_way and -snapshot.ego.body.kind.length < found.ahead <= within:
            yield found
