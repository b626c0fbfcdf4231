"""The walks of pedestrians beside and across a street: the suites ``cav-gym``, ``chance-2019``.

Sources: CAV-Gym (github.com/TSL-UOB/CAV-Gym), and Chance et al., An Agency-Directed Approach to
Test Generation for Simulation-based Autonomous Vehicle Verification (arXiv 1912.05434) with its
code (github.com/TSL-UOB/CAV-MAS). Everybody begins anywhere on either pavement, and walks along the
road, in either direction, at 1.4 m/s. The tester decides who steps off, every 0.1 s::

    random               each goes one of four ways or stands, chosen anew by chance
    programmed-random    who walks along crosses by chance
    proximity            who walks along and is near crosses
    election             of those the nearest crosses, while nobody else does

Who crosses goes straight to the opposite place and walks on along the road. Distances are those to
an ego that keeps its speed; a walk is fixed before it begins, and adapts to nobody.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from random import Random

from cavsumo.errors import UnknownName

Points = list[list[float]]

WALK_MPS, EVERY_S = 1.4, 0.1
WAYS = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (0.0, 0.0))


@dataclass(frozen=True)
class WalkedStreet:
    """A straight street from x = 0, its middle at y = 0, and an ego that keeps its speed.

    Attributes:
        length, kerb, pavement: its length, half the width of the carriageway, and the width of
            each pavement [m].
        mark: the point of the ego, at the beginning, from which distances count [m].
        ego_mps: its speed.
        seconds: how long walks are.
        near: radius within which a pedestrian is near [m].
        away: distance of a pedestrian from the mark by the differences of their places [m].
        changes, crosses: how often one walks differently, or crosses, by chance [1/s].
        begins: whether a pedestrian may begin at a place.
    """

    length: float
    kerb: float
    pavement: float
    mark: tuple[float, float]
    ego_mps: float
    seconds: float
    near: float
    away: Callable[[float, float], float]
    changes: float
    crosses: float
    begins: Callable[[float, float], bool]


@dataclass
class StreetWalker:
    """A pedestrian: its place, its direction (0, 0 stands), and the far side while it crosses."""

    x: float
    y: float
    towards: tuple[float, float]
    along: tuple[float, float]
    goal: float | None = None
    walked: Points = field(default_factory=list)

    def cross(self) -> None:
        """Begin to cross to the opposite place."""
        self.goal = -self.y
        self.towards = (0.0, math.copysign(1.0, self.goal))

    def step(self) -> None:
        """Walk on for one step; who has crossed walks along the road again."""
        self.walked.append([self.x, self.y])
        far = WALK_MPS * EVERY_S
        self.x += far * self.towards[0]
        self.y += far * self.towards[1]
        if self.goal is not None and abs(self.goal - self.y) < far / 2:
            self.goal, self.towards = None, self.along


def _chance_away(dx: float, dy: float) -> float:
    """City-block distance to the nearest of the four cells of 1.5 m across the ego's lane [m]."""
    return abs(dx) + max(0.0, abs(dy) - 2.25)


def _chance_begins(x: float, y: float) -> bool:
    """Whether one can reach the ego's lane, 6 m wide at y = -3, before the ego's zone is past."""
    return x >= 9.0 * (abs(y + 3.0) - 3.0) / WALK_MPS


# The mark of CAV-Gym is the centre of the ego, that of Chance et al. lies at the end of its
# stopping distance. Random changes: CAV-Gym's 0.01 in a step at 60 Hz; one in a second, and a
# chance of 1 in 11 in a second to cross.
CAV_GYM = WalkedStreet(
    *(99.0, 3.65, 3.0, (2.25, -1.825), 6.75, 14.0, 34.0, math.hypot),
    *(0.603, 0.603, lambda x, y: True),
)
CHANCE = WalkedStreet(
    *(99.0, 6.0, 3.0, (0.0, -3.0), 9.0, 11.0, 22.5, _chance_away),
    *(1.0, -math.log(10 / 11), _chance_begins),
)


def cav_gym_points(tester: str, pedestrians: float, draw: float, index: float) -> Points:
    """The places of one pedestrian of a case of ``cav-gym``, every 0.1 s."""
    return walks(CAV_GYM, tester, int(pedestrians), int(draw))[int(index)]


def chance_points(tester: str, pedestrians: float, draw: float, index: float) -> Points:
    """The same of ``chance-2019``."""
    return walks(CHANCE, tester, int(pedestrians), int(draw))[int(index)]


def walks(street: WalkedStreet, tester: str, pedestrians: int, draw: int) -> list[Points]:
    """The walks of all pedestrians; the same number of a draw begins alike for every tester."""
    if tester not in TESTERS:
        raise UnknownName("tester", tester, TESTERS)
    rng = Random(f"{pedestrians} {draw}")
    walkers = [_begun(street, rng) for _ in range(pedestrians)]
    for k in range(round(street.seconds / EVERY_S) + 1):
        x, y = street.mark[0] + street.ego_mps * k * EVERY_S, street.mark[1]
        TESTERS[tester](street, walkers, [street.away(w.x - x, w.y - y) for w in walkers], rng)
        for walker in walkers:
            walker.step()
    return [walker.walked for walker in walkers]


def _begun(street: WalkedStreet, rng: Random) -> StreetWalker:
    """A pedestrian anywhere on a pavement where one may begin."""
    while True:
        side, way = rng.choice((-1.0, 1.0)), rng.choice((-1.0, 1.0))
        x = rng.uniform(0.0, street.length)
        y = side * (street.kerb + rng.uniform(0.0, street.pavement))
        if street.begins(x, y):
            return StreetWalker(x, y, (way, 0.0), (way, 0.0))


def _happens(rate: float, rng: Random) -> bool:
    """Whether an event of a rate [1/s] happens in a step."""
    return rng.random() < 1.0 - math.exp(-rate * EVERY_S)


def _wander(
    street: WalkedStreet, walkers: Sequence[StreetWalker], _: Sequence[float], rng: Random
) -> None:
    """``random``."""
    for walker in walkers:
        if _happens(street.changes, rng):
            walker.towards = rng.choice(WAYS)


def _chance(
    street: WalkedStreet, walkers: Sequence[StreetWalker], _: Sequence[float], rng: Random
) -> None:
    """``programmed-random``."""
    for walker in walkers:
        if walker.goal is None and _happens(street.crosses, rng):
            walker.cross()


def _near(
    street: WalkedStreet, walkers: Sequence[StreetWalker], away: Sequence[float], rng: Random
) -> None:
    """``proximity``."""
    for walker, distance in zip(walkers, away, strict=True):
        if walker.goal is None and distance < street.near:
            walker.cross()


def _elect(
    street: WalkedStreet, walkers: Sequence[StreetWalker], away: Sequence[float], rng: Random
) -> None:
    """``election``."""
    if all(walker.goal is None for walker in walkers):
        i = min(range(len(walkers)), key=away.__getitem__)
        if away[i] < street.near:
            walkers[i].cross()


Tester = Callable[[WalkedStreet, Sequence[StreetWalker], Sequence[float], Random], None]
TESTERS: dict[str, Tester] = {
    "random": _wander,
    "programmed-random": _chance,
    "proximity": _near,
    "election": _elect,
}
