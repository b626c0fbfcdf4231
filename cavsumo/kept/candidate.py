"""An episode that can be made smaller: the motions of its testers, the background, the approach."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from cavsumo.agents.recorded import Recorded
from cavsumo.kept.motion import BodyMotion
from cavsumo.model.bodies import Kind
from cavsumo.model.carriageway import StartRecord
from cavsumo.model.departures import Attributes, Demand, Entry, Trip, Walk

TENTH = 10.0  # timesteps in a second, as usual: whole seconds have a digit less
SPARE_STEPS = 50  # for which motions in legs are told beyond the length of the recorded episode


@dataclass(frozen=True)
class FixedPart:
    """The part of an episode that stays as it is.

    Attributes:
        recorded: the episode as it was recorded.
        kind: of the testers.
        dt: length of a timestep [s].
    """

    recorded: Recorded
    kind: Kind
    dt: float

    @property
    def types(self) -> dict[str, Attributes]:
        """The vehicle types of the background."""
        there = self.recorded.departures
        return {} if there is None else dict(there.types)


@dataclass(frozen=True)
class Candidate:
    """An episode, perhaps made smaller.

    Attributes:
        numbers: of its testers, as they are numbered in the recorded episode.
        motions: of each of them.
        waited: where they wait for the ego to enter, if elsewhere than where they start.
        trips, walks: the background.
        entry: where the ego enters, if not at the beginning of its route.
        cut: how many timesteps later than the recorded episode it begins.
    """

    numbers: tuple[int, ...]
    motions: tuple[BodyMotion, ...]
    waited: tuple[StartRecord, ...] = ()
    trips: tuple[Trip, ...] = ()
    walks: tuple[Walk, ...] = ()
    entry: Entry | None = None
    cut: int = 0

    @property
    def background(self) -> tuple[Trip | Walk, ...]:
        """All of the background."""
        return (*self.trips, *self.walks)

    @property
    def segments(self) -> int:
        """The segments of the testers' motion, together."""
        return sum(motion.segments for motion in self.motions)

    @property
    def cost(self) -> tuple[int, ...]:
        """A measure of its size: bodies, then segments and bends, then length, then digits."""
        bends = sum(bool(motion.way) or not motion.legs for motion in self.motions)
        bodies = len(self.motions), len(self.background), len(self.waited)
        return (*bodies, self.segments, bends, -self.cut, sum(map(len, self._numerals())))

    def _numerals(self) -> Iterator[str]:
        """The numbers of which it consists, as text."""
        for motion in self.motions:
            x, y, o, v = motion.start[:4]
            yield from (numeral(x), numeral(y), numeral(math.degrees(o)), numeral(v or 0.0))
            for step, speed in motion.legs:
                yield from (numeral(step / TENTH), numeral(speed))
        if self.entry is not None:
            yield from (numeral(self.entry.along), numeral(self.entry.speed))

    def recorded(self, fixed: FixedPart) -> Recorded:
        """The record that plays it."""
        was = fixed.recorded
        steps = len(was.actions) - self.cut + SPARE_STEPS
        played = [motion.played(fixed.kind, steps, fixed.dt) for motion in self.motions]
        length = min(map(len, played))
        demand = None
        if was.departures is not None:
            demand = Demand(self.trips, self.walks, fixed.types, self.entry)
        return Recorded(
            was.seed,
            [tuple(joint) for joint in zip(*(one[:length] for one in played), strict=True)],
            [motion.start for motion in self.motions],
            self.waited,
            demand,
            was.approaches,
        )


def numeral(value: float) -> str:
    """A number as text, without its rounding error."""
    return f"{round(value, 9):.9f}".rstrip("0")


def as_recorded(recorded: Recorded) -> Candidate:
    """A recorded episode, from which nothing has been taken."""
    there = recorded.departures or Demand()
    bodies = range(len(recorded.starts))
    motions = [
        BodyMotion(recorded.starts[i], actions=tuple(joint[i] for joint in recorded.actions))
        for i in bodies
    ]
    waited, ego = tuple(recorded.waited), there.ego
    return Candidate(tuple(bodies), tuple(motions), waited, there.trips, there.walks, ego)


def of_testers(candidate: Candidate, kept: Sequence[int]) -> Candidate:
    """A candidate with some of its testers, by their places among them."""

    return replace(
        candidate,
        numbers=tuple(candidate.numbers[i] for i in kept),
        motions=tuple(candidate.motions[i] for i in kept),
        waited=tuple(candidate.waited[i] for i in kept if candidate.waited),
    )
