"""How far the ego came in an episode, how long it stood, and what it lost against a free drive.

The *free drive* is computed, not simulated: a driver alone on the ego's path who sets out with the
ego's first speed, accelerates with 2.6 m/s2 and brakes with 4.5 m/s2 (SUMO's defaults for a
passenger car), keeps to the speed limit of every lane, and meets no light, no sign and nobody:

    v(s) <= limit(s),   v(s)^2 <= v0^2 + 2 a s,   v(s)^2 <= v(s')^2 + 2 b (s' - s) for all s' > s

with v0 at s = 0, on a grid of one metre, between whose points v^2 changes evenly. So it is the same
for every ego, also for one that never drives faster than at walking pace.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

from cavsumo.assertions.contacts import STANDING_MPS
from cavsumo.model.carriageway import Limit
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

ACCELERATION, DECELERATION = 2.6, 4.5  # m/s2, of the free drive
GRID_M = 1.0
LASTING_S = 10.0  # standing for so long at the end is a stop; moving for so long is judged
CRAWL = 4.0  # as many times as long as the free drive is a crawl
STOOD, CRAWLED = "stood", "crawled"


@dataclass(frozen=True)
class EgoProgress:
    """The progress of the ego.

    Attributes:
        arrived: whether it reached the end of its route; None if the episode ended before the ego
            could.
        driven: the distance along its path [m].
        time: the duration of the episode [s].
        lost: how much of that the free drive to the same place would have saved [s]; negative for
            an ego that is faster; None without speed limits to compare with, and where the episode
            was cut.
        stood: total time of standing [s].
        stood_last: time of standing until the end [s].
    """

    arrived: bool | None = None
    driven: float = 0.0
    time: float = 0.0
    lost: float | None = None
    stood: float = 0.0
    stood_last: float = 0.0

    @property
    def frozen(self) -> str:
        """STOOD for an ego that had been standing long, CRAWLED for a slow one, else empty.

        It crawled if it needed, while it moved, more than ``CRAWL`` times as long as the free
        drive. Reasons (a red light, a body in its way) do not count.
        """
        if self.stood_last >= LASTING_S - 1e-9:
            return STOOD
        moved = self.time - self.stood
        slow = self.lost is not None and moved > CRAWL * (self.time - self.lost)
        return CRAWLED if slow and moved >= LASTING_S - 1e-9 else ""


def ego_progress(
    scene: Scene, history: Sequence[Snapshot], arrived: bool | None, *, cut: bool = False
) -> EgoProgress:
    """The progress of the ego in the snapshots of an episode.

    ``cut``: it ended although the ego could drive on, so that what it would have lost is not known.
    """
    first, last = history[0], history[-1]
    path = scene.ego_path
    begin, end = (path.project(s.ego.x, s.ego.y).along for s in (first, last))
    time = last.time - first.time
    standing = [snapshot.ego.v <= STANDING_MPS for snapshot in history[1:]]
    moved_last = next((i for i, stands in enumerate(reversed(standing)) if not stands), None)
    free = free_time(scene.limits, path.length, begin, end, first.ego.v)
    return EgoProgress(
        arrived,
        driven=end - begin,
        time=time,
        lost=None if free is None or cut else time - free,
        stood=sum(standing) * scene.dt,
        stood_last=(len(standing) if moved_last is None else moved_last) * scene.dt,
    )


def free_time(
    limits: Sequence[Limit], length: float, begin: float, end: float, speed: float
) -> float | None:
    """How long the free drive takes from one place to another [s]; None without limits.

    Args:
        limits: on the path, in order.
        length: of the path [m].
        begin, end: arc lengths on it [m].
        speed: at the beginning [m/s].
    """
    if not limits:
        return None
    cells = max(1, math.ceil((length - begin) / GRID_M))
    top = [_limit(limits, begin + i * GRID_M) for i in range(cells + 1)]
    squares = [min(speed, top[0]) ** 2]
    for limit in top[1:]:
        squares.append(min(limit * limit, squares[-1] + 2.0 * ACCELERATION * GRID_M))
    for i in range(cells - 1, -1, -1):
        squares[i] = min(squares[i], squares[i + 1] + 2.0 * DECELERATION * GRID_M)
    time, left = 0.0, max(0.0, end - begin)
    for before, after in itertools.pairwise(squares):
        way = min(GRID_M, left)
        there = before + (after - before) * way / GRID_M  # of the speed squared
        time += 2.0 * way / (math.sqrt(before) + math.sqrt(there)) if way > 0.0 else 0.0
        left -= way
    return time


def _limit(limits: Sequence[Limit], along: float) -> float:
    """The speed limit at a place [m/s]; the first one also before it holds."""
    found = limits[0].speed
    for limit in limits:
        if limit.along > along:
            break
        found = limit.speed
    return found
