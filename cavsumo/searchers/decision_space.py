"""The space of tests by decisions: a start, and once a second a heading and a speed.

A point is a row for each moment, the start first, with two numbers for each body: place and arrival
of the start, heading and speed of a decision (``agents.decisions``). So a point that begins like
another one repeats it up to there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cavsumo.agents.decisions import Decision, Decisions
from cavsumo.agents.programme import WalkProgramme
from cavsumo.agents.searched import Programme
from cavsumo.searchers.places import Place, within
from cavsumo.searchers.space import Point, Space
from cavsumo.searchers.walks import SLOWEST_MPS

DECISIONS = 10
ARRIVALS_S = (1.0, 8.0)
STANDING = 0.2  # a speed below is to stand
SAME, STAND, ACROSS = 0.4, 0.2, 0.3  # how often a body decides so; else it turns anywhere
OBLIQUE = (1.0 / 3.0, 2.0 / 3.0)  # of all headings those within 60 degrees of the way across
STRAIGHT = {"speed": 1.0, "heading": 0.5, "depth": 1.0}
BY_ITSELF = 0.3  # a further body takes part, not together with the first one
NOT_KNOWN = math.nan


@dataclass(frozen=True)
class DecisionSpace:
    """The tests by decisions at the places of another space, for bodies that walk.

    Attributes:
        base: that space.
    """

    base: Space

    @property
    def dimension(self) -> int:
        """How many numbers a point has."""
        return (1 + DECISIONS) * self.width

    @property
    def width(self) -> int:
        """How many numbers a start or a decision has."""
        return 2 * self.base.bodies

    def memories(self, point: Point) -> tuple[dict[str, Any], ...]:
        """The memories with which the agents of ``agents.searched`` play a point."""
        told = self.base.memories(self._starts(point))
        return tuple(
            {**memory, "programmes": [self._decisions(point, i)._asdict() for i in team]}
            for memory, team in zip(told, self.base.teams, strict=True)
        )

    def place(self, point: Point, body: int) -> Place:
        """Where a body starts."""
        return self.base.place(self._starts(point), body)

    def played(self, point: Point) -> list[tuple[Place, Programme | None]]:
        """Places, and the programmes whose first legs the decisions begin with."""
        return [(self.place(point, i), self._likeness(point, i)) for i in range(self.base.bodies)]

    def start(self, rng: np.random.Generator) -> NDArray[np.float64]:
        """A start by chance."""
        return rng.random(self.width)

    def decision(
        self, rng: np.random.Generator, last: NDArray[np.float64] | None
    ) -> NDArray[np.float64]:
        """A decision by chance after the last one, None for the first: often the same again."""
        fresh = rng.random((self.base.bodies, 2))
        for i in range(self.base.bodies):
            how = float(rng.random())
            if last is not None and how < SAME:
                fresh[i] = last[2 * i : 2 * i + 2]
            elif last is not None and how < SAME + STAND:
                fresh[i] = (0.5 if last is None else last[2 * i]), STANDING / 2.0
            elif last is None or how < SAME + STAND + ACROSS:
                fresh[i, 0] = rng.uniform(*OBLIQUE)
        return fresh.ravel()

    def completed(self, rng: np.random.Generator, begun: NDArray[np.float64]) -> Point:
        """A point that begins with some rows and goes on by chance."""
        rows = list(begun)
        if not rows:
            rows.append(self.start(rng))
        while len(rows) < 1 + DECISIONS:
            rows.append(self.decision(rng, rows[-1] if len(rows) > 1 else None))
        return np.concatenate(rows)

    def rows(self, point: Point) -> NDArray[np.float64]:
        """Start and decisions of a point; shape (1 + DECISIONS, width)."""
        return point.reshape(1 + DECISIONS, self.width)

    def _starts(self, point: Point) -> Point:
        """A point of the other space whose bodies start there, to go straight across."""
        found = np.full(self.base.dimension, BY_ITSELF)
        for i in range(self.base.bodies):
            for name, share in {**STRAIGHT, "place": point[2 * i]}.items():
                found[self.base.index(i, name)] = share
        return found

    def _decisions(self, point: Point, body: int) -> Decisions:
        """The decisions of one body."""
        rows = self.rows(point)[:, 2 * body : 2 * body + 2].tolist()
        return Decisions(within(ARRIVALS_S, rows[0][1]), [self._decided(*row) for row in rows[1:]])

    def _decided(self, heading: float, speed: float) -> Decision:
        """The decision of two numbers."""
        share = (speed - STANDING) / (1.0 - STANDING)
        fast = within((SLOWEST_MPS, self.base.movements.kind.v_max), share)
        return Decision((2.0 * heading - 1.0) * math.pi, 0.0 if share < 0.0 else fast)

    def _likeness(self, point: Point, body: int) -> WalkProgramme:
        """A programme with the first leg of the decisions; other features are not known."""
        chosen = self._decisions(point, body).chosen
        heading, speed = next((one for one in chosen if one.speed > 0.0), chosen[0])
        rest = (NOT_KNOWN, 0.0, None, speed, NOT_KNOWN, 0.0, NOT_KNOWN)
        return WalkProgramme(NOT_KNOWN, speed, heading, *rest)
