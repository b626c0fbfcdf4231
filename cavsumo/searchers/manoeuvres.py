"""Manoeuvres for which people on the road are known, as distributions over the space of tests.

A search begins here: a blindly timed crossing, somebody slow or oblique, who hesitates, turns back,
or walks along the lane and turns in; a vehicle that runs the line, creeps over it or stands in the
way; and two that act together. Every number that a manoeuvre leaves open is uniform.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from cavsumo.searchers.bounds import part
from cavsumo.searchers.drives import THROUGH as ON_SHARE
from cavsumo.searchers.expected import Expected, value_of
from cavsumo.searchers.protocol import GENERATION, PlayedPoint
from cavsumo.searchers.space import ALONE, AS_IT_BRAKES, TOGETHER, Point, Space

Range = tuple[float, float]
STRAIGHT: Range = (0.45, 0.55)
THROUGH: Range = (0.98, 1.0)
LATE: Range = (0.15, 0.5)  # as an ego that did not react before could hardly stop
EARLY: Range = (0.2, 1.0)
SHORT: Range = (0.1, 0.4)  # as an ego that keeps its speed could not stop any more
TIMED: Range = (0.65, 0.75)  # as an ego that reacts at once can just stop
SOON: Range = (0.1, 0.7)  # of vehicles, that late
FROM_LEFT: Range = (0.5, 1.0)  # beyond the oncoming lane, where traffic keeps to the right
ON: Range = (ON_SHARE, 1.0)  # without a stop

# For each manoeuvre the ranges of some coordinates of ``walks.Walks`` and ``drives.Drives``.
WALKS: Mapping[str, Mapping[str, Range]] = {
    "crosses in time": {
        "zone": TIMED, "speed": (0.95, 1.0), "heading": STRAIGHT, "depth": THROUGH,
    },
    "comes from afar and stops in the way": {
        "place": FROM_LEFT, "zone": (0.08, 0.26), "speed": (0.75, 1.0), "heading": (0.1, 0.55),
        "depth": (0.62, 0.97),
    },
    "crosses": {"zone": LATE, "speed": (0.5, 1.0), "heading": STRAIGHT, "depth": THROUGH},
    "crosses slowly": {"zone": LATE, "speed": (0.0, 0.35), "heading": STRAIGHT, "depth": THROUGH},
    "comes towards": {"zone": LATE, "speed": (0.0, 0.6), "heading": (0.0, 0.35), "depth": THROUGH},
    "walks away": {"zone": LATE, "heading": (0.65, 1.0), "depth": THROUGH},
    "comes closer, then steps in": {
        "zone": SHORT, "speed": (0.0, 0.5), "heading": (0.1, 0.6), "depth": (0.05, 0.3),
        "resume": (0.0, 0.12), "speed_2": (0.7, 1.0), "heading_2": (0.3, 0.5),
        "length_2": (0.7, 1.0), "heading_3": (0.3, 0.5),
    },
    "hesitates": {
        "zone": EARLY, "depth": (0.05, 0.4), "resume": (0.1, 0.4), "heading_2": STRAIGHT,
        "heading_3": STRAIGHT,
    },
    "waits on the road": {
        "zone": EARLY, "depth": (0.0, 0.35), "resume": (0.43, 0.58), "heading_2": STRAIGHT,
        "heading_3": STRAIGHT,
    },
    "turns back": {
        "zone": EARLY, "depth": (0.6, 0.97), "resume": (0.0, 0.25), "heading_2": (0.85, 1.0),
        "length_2": (0.3, 1.0), "heading_3": (0.9, 1.0),
    },
    "turns in": {
        "zone": EARLY, "depth": (0.0, 0.35), "resume": (0.0, 0.15), "heading_2": (0.15, 0.3),
        "heading_3": (0.4, 0.6), "length_2": (0.1, 0.8),
    },
    "stands": {"zone": EARLY, "depth": (0.35, 0.8), "resume": (0.32, 0.4)},
}  # fmt: skip
DRIVES: Mapping[str, Mapping[str, Range]] = {
    "does not stop": {"zone": SOON, "speed": (0.5, 1.0), "effort": (0.5, 1.0), "depth": ON},
    "does not stop, slowly": {"zone": SOON, "speed": (0.0, 0.4), "depth": ON},
    "stops in the way": {"zone": EARLY, "depth": (0.28, 0.55), "resume": (0.3, 0.4)},
    "creeps": {"zone": EARLY, "speed": (0.0, 0.3), "depth": (0.15, 0.3), "resume": (0.3, 0.4)},
    "hesitates": {"zone": SOON, "depth": (0.1, 0.28), "resume": (0.1, 0.4)},
    "waits for the ego": {"zone": EARLY, "depth": (0.1, 0.28), "resume": (0.43, 0.58)},
    "goes on as the ego brakes": {"zone": EARLY, "depth": (0.1, 0.28), "resume": (0.7, 0.85)},
}
# By the name of the movements.
MANOEUVRES: Mapping[str, Mapping[str, Mapping[str, Range]]] = {"walks": WALKS, "drives": DRIVES}

APART: Mapping[str, Range] = {"company": (ALONE, TOGETHER), "reaction": (0.0, AS_IT_BRAKES)}
# Two that act together: ranges of the first and of the second.
NEAR: Mapping[str, Range] = {"company": (TOGETHER, 1.0), "reaction": (0.0, AS_IT_BRAKES)}
BEHIND: Mapping[str, Range] = {**NEAR, "place": (0.28, 0.36)}  # on the same side, 1 to 3.5 m on
PAIRS: Mapping[str, Sequence[tuple[Mapping[str, Range], Mapping[str, Range]]]] = {
    "walks": (
        (WALKS["hesitates"], {**BEHIND, **WALKS["crosses"], "zone": (0.0, 0.6)}),
        (WALKS["waits on the road"], {**NEAR, **WALKS["crosses"], "zone": (0.0, 0.6)}),
        (WALKS["crosses"], {**NEAR, **WALKS["crosses slowly"], "zone": (0.1, 0.6)}),
        (WALKS["stands"], {**NEAR, **WALKS["comes towards"], "zone": (0.1, 0.6)}),
        (
            {**WALKS["crosses"], "zone": EARLY},
            {**NEAR, **WALKS["crosses"], "reaction": (AS_IT_BRAKES, 1.0), "zone": (0.0, 0.5)},
        ),
    ),
    "drives": (
        (DRIVES["hesitates"], {**BEHIND, **DRIVES["does not stop"], "zone": (0.0, 0.6)}),
        (DRIVES["creeps"], {**NEAR, **DRIVES["does not stop"], "zone": (0.0, 0.6)}),
        (
            {**DRIVES["does not stop"], "zone": EARLY},
            {"company": (ALONE, 1.0), **DRIVES["does not stop"], "reaction": (AS_IT_BRAKES, 1.0)},
        ),
    ),
}

ANY = 0.25  # how often the next one in turn comes all the same
# An ego that decides only now and then seldom reacts before a body is in its way, which is unfair
# if it can then not stop: the least share of "zone" against it, by the name of the movements.
LEAST_ZONE = {"walks": 0.3}
PRIOR, LEAST = 0.4, 0.05  # value of a manoeuvre of which nothing is known, and the least
TRIES = 8  # draws of a point, of which the one that promises most is played
TYPICAL_S = 20.0  # a manoeuvre of which nothing is known takes so long

Ranges = Mapping[str, Range]


@dataclass
class ManoeuvreSearch:
    """Each point a known manoeuvre, of each body at a place of its own, or a pair of two.

    First each in turn; then those more often that come near preventable failures in a short time.
    """

    space: Space
    rng: np.random.Generator
    uniform: bool = False
    _turn: int = 0
    _drawn_as: dict[bytes, int] = field(default_factory=dict)
    _worth: dict[int, tuple[float, float]] = field(default_factory=dict)

    @cached_property
    def expected(self) -> Expected:
        """The results that are expected of points."""
        return Expected(self.space)

    @cached_property
    def sorts(self) -> Sequence[Sequence[Ranges]]:
        """The manoeuvres of the bodies, for each sort of point: first the same of all, then pairs.

        Further bodies than a pair has do one manoeuvre after the other.
        """
        name, bodies = self.space.movements.name, self.space.bodies
        known = list(MANOEUVRES[name].values())
        same: list[Sequence[Ranges]] = [(one, *[{**APART, **one}] * (bodies - 1)) for one in known]
        pairs = PAIRS[name] if bodies > 1 else ()
        return [
            *same,
            *(
                (*two, *({**APART, **known[i % len(known)]} for i in range(2, bodies)))
                for two in pairs
            ),
        ]

    def ask(self) -> list[Point]:
        return [self._next() for _ in range(GENERATION)]

    def tell(self, points: Sequence[Point], told: Sequence[PlayedPoint]) -> None:
        self.expected.tell(points, told)
        for point, result in zip(points, told, strict=True):
            sort = self._drawn_as.pop(point.tobytes(), None)
            if sort is not None:
                value, took = self._worth.get(sort, (0.0, 0.0))
                self._worth[sort] = value + value_of(result), took + result.seconds / TYPICAL_S

    def most_promising(self, draw: Callable[[], Point]) -> Point:
        """The one of several points that promises most."""
        return max((draw() for _ in range(TRIES)), key=self.expected.value)

    def _next(self) -> Point:
        """A point of the next manoeuvre."""
        sort = self._sort()
        point = self.most_promising(lambda: self._drawn(self.sorts[sort]))
        self._drawn_as[point.tobytes()] = sort
        self._turn += 1
        return point

    def _drawn(self, manoeuvres: Sequence[Ranges]) -> Point:
        """A point whose bodies do these manoeuvres."""
        point = self.rng.random(self.space.dimension)
        for i, ranges in enumerate(manoeuvres):
            for coordinate, wanted in ranges.items():
                low, high = part(self.space.movements, coordinate, wanted)
                point[self.space.index(i, coordinate)] = self.rng.uniform(low, high)
            self._delay(point, i)
        return point

    def _delay(self, point: Point, body: int) -> None:
        """Let a body come later against an ego that decides only now and then."""
        space, zone = self.space, self.space.index(body, "zone")
        together = body and space.share(point, body, "company") >= TOGETHER
        if space.every and not together:
            point[zone] = max(point[zone], LEAST_ZONE.get(space.movements.name, 0.0))

    def _sort(self) -> int:
        """Which sort of point comes next."""
        count = len(self.sorts)
        if self._turn < count or self.rng.random() < ANY:
            return self._turn % count
        known = [self._worth.get(i, (0.0, 0.0)) for i in range(count)]
        worth = np.array([max(LEAST, value + PRIOR) / (took + 1.0) for value, took in known]) ** 2
        return int(self.rng.choice(count, p=worth / worth.sum()))
