"""A track: the places of a body at even times, between which it moves straight and evenly."""

from __future__ import annotations

import math
from functools import cached_property
from itertools import pairwise
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from cavsumo.model.scenario.sensor import Finite

Place = tuple[Finite, Finite]


class ScriptedTrack(BaseModel):
    """The places of a body's middle; after the last one it stands."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    every_s: Annotated[float, Field(ge=0.01, le=10, allow_inf_nan=False)] = Field(
        description="time between two places [s]"
    )
    points_m: tuple[Place, ...] = Field(
        min_length=2, max_length=100_000, description="places, from when the ego entered on [m]"
    )

    def at(self, time: float) -> Place:
        """The place at a time >= 0 [s]."""
        last = len(self.points_m) - 1
        share, i = math.modf(min(max(0.0, time / self.every_s), last))
        # Times of timesteps are sums: a place itself must not depend on their rounding.
        whole = int(i) + (share > 1.0 - 1e-9)
        share = 0.0 if share < 1e-9 or whole > i else share
        (x, y), (x1, y1) = self.points_m[whole], self.points_m[min(whole + 1, last)]
        return x + share * (x1 - x), y + share * (y1 - y)

    @cached_property
    def speeds(self) -> tuple[float, ...]:
        """The speeds between the places [m/s]."""
        return tuple(math.dist(a, b) / self.every_s for a, b in pairwise(self.points_m))

    @property
    def heading(self) -> float:
        """The heading at its beginning, that of the first step away [rad]."""
        first = self.points_m[0]
        away = next((p for p in self.points_m if p != first), (first[0] + 1.0, first[1]))
        return math.atan2(away[1] - first[1], away[0] - first[0])
