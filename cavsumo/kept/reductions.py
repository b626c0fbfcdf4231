"""All the ways to make an episode smaller by one step; each is a candidate that has to be played.

Each function gives the reductions of a candidate, large ones first (``shrinking``).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from cavsumo.kept.candidate import Candidate, FixedPart, of_testers
from cavsumo.kept.motion import BodyMotion, MotionLeg, TrackToViolation, in_legs
from cavsumo.kept.shrinking import subsets
from cavsumo.model.bodies import NOOP, WALKING, Kind
from cavsumo.model.departures import Entry, Trip, Walk

SHARES = (7 / 8, 3 / 4, 1 / 2, 1 / 4)  # of the time before the violation that are cut at once
SECONDS = (4, 2, 1)  # and times [s]
# How much earlier or later the testers move once others are gone [s].
SHIFTS_S = tuple(0.1 * n for n in (*range(1, 11), *range(12, 32, 2)))
PLACES = (0, 1, 2)  # decimals to which places, angles and speeds are rounded
ANGLES = (45.0, 5.0, 1.0, 0.1)  # degrees of whose multiples headings are made


@dataclass(frozen=True)
class Tracks:
    """How a candidate was played.

    Attributes:
        poses: of its testers up to the violation: for each timestep those of all.
        entries: where the ego could enter at a timestep; none inside junctions.
    """

    poses: Sequence[Sequence[tuple[float, float, float, float]]]
    entries: Mapping[int, Entry]

    @property
    def end(self) -> int:
        """The timestep of the violation."""
        return len(self.poses) - 1


@dataclass(frozen=True)
class Reductions:
    """The reductions of candidates of one episode.

    Attributes:
        fixed: the episode.
        met: the id of the background body, or the number of the tester, of the violation.
        tracks: how a candidate was played.
    """

    fixed: FixedPart
    met: str | int
    tracks: Callable[[Candidate], Tracks]

    @property
    def passes(self) -> tuple[Callable[[Candidate], Iterator[Candidate]], ...]:
        """All kinds, in the order in which they are tried."""
        return (
            self.testers,
            self.waits,
            self.background,
            self.motions,
            self.approach,
            self.retimed,
            self.numbers,
        )

    def all(self, candidate: Candidate) -> Iterator[Candidate]:
        """All single reductions of a candidate."""
        found = itertools.chain.from_iterable(one(candidate) for one in self.passes)
        return (one for one in found if one.cost < candidate.cost)

    def testers(self, candidate: Candidate) -> Iterator[Candidate]:
        """Fewer testers."""
        places = range(len(candidate.numbers))
        others = [i for i in places if candidate.numbers[i] != self.met]
        for kept in subsets(others):
            left = sorted({*places} - {*others} | {*kept})
            if left:
                yield of_testers(candidate, left)

    def waits(self, candidate: Candidate) -> Iterator[Candidate]:
        """Testers that are where they start from the beginning on."""
        if candidate.waited:
            yield replace(candidate, waited=())

    def background(self, candidate: Candidate) -> Iterator[Candidate]:
        """Less background."""
        others = [one for one in candidate.background if one.id != self.met]
        bound = [one for one in candidate.background if one.id == self.met]
        for kept in subsets(others):
            left = {*kept, *bound}
            yield replace(
                candidate,
                trips=tuple(trip for trip in candidate.trips if trip in left),
                walks=tuple(walk for walk in candidate.walks if walk in left),
            )

    def motions(self, candidate: Candidate) -> Iterator[Candidate]:
        """Simpler motions, one at a time."""
        tracks = self.tracks(candidate)
        for place, motion in enumerate(candidate.motions):
            track = tuple(poses[place] for poses in tracks.poses)
            for simpler in self._simpler(
                motion, TrackToViolation(track, self.fixed.kind, self.fixed.dt)
            ):
                yield _with_motion(candidate, place, simpler)

    def _simpler(self, motion: BodyMotion, met: TrackToViolation) -> Iterator[BodyMotion]:
        """Motions in fewer segments, or on a straighter way."""
        yield from in_legs(motion, met)
        for i in range(len(motion.legs)):
            yield _without_leg(motion, i)
        acting = [i for i, action in enumerate(motion.actions) if action != NOOP]
        if not motion.legs:
            for kept in subsets(acting):
                left = {*kept}
                quiet = (a if i in left else NOOP for i, a in enumerate(motion.actions))
                yield replace(motion, actions=tuple(quiet))

    def approach(self, candidate: Candidate) -> Iterator[Candidate]:
        """A later beginning."""
        tracks, dt = self.tracks(candidate), self.fixed.dt
        if self.fixed.recorded.departures is None:
            return  # the ego's entry is told with those of the background
        whole = [math.floor(share * tracks.end * dt) for share in SHARES]
        for seconds in dict.fromkeys((*whole, *SECONDS)):
            steps = round(seconds / dt)
            if 0 < steps < tracks.end and steps in tracks.entries:
                yield _later(candidate, steps, tracks, dt)

    def retimed(self, candidate: Candidate) -> Iterator[Candidate]:
        """Fewer testers, or no background, the testers earlier or later.

        An ego that no longer brakes for somebody comes at another time.
        """
        fewer = [one for one in self.testers(candidate) if one.cost < candidate.cost]
        for smaller in (*fewer, *itertools.islice(self.background(candidate), 1)):
            for seconds in SHIFTS_S:
                steps = round(seconds / self.fixed.dt)
                yield from _shifted(smaller, steps, self.fixed.dt)
                yield from _shifted(smaller, -steps, self.fixed.dt)

    def numbers(self, candidate: Candidate) -> Iterator[Candidate]:
        """Rounder numbers."""
        for place, motion in enumerate(candidate.motions):
            for rounder in _rounder(motion, self.fixed.kind, self.fixed.dt):
                yield _with_motion(candidate, place, rounder)
        if candidate.entry is not None:
            edge, lane, along, speed = candidate.entry
            for digits in PLACES:
                yield replace(candidate, entry=Entry(edge, lane, round(along, digits), speed))
                yield replace(candidate, entry=Entry(edge, lane, along, round(speed, digits)))


def _with_motion(candidate: Candidate, place: int, motion: BodyMotion) -> Candidate:
    """A candidate with another motion of one tester."""
    motions = list(candidate.motions)
    motions[place] = motion
    return replace(candidate, motions=tuple(motions))


def _shifted(candidate: Candidate, steps: int, dt: float) -> Iterator[Candidate]:
    """A candidate whose testers move some timesteps earlier; none where one cannot."""
    motions = [motion.shifted(steps, dt) for motion in candidate.motions]
    found = tuple(motion for motion in motions if motion is not None)
    if len(found) == len(motions):
        yield replace(candidate, motions=found)


def _without_leg(motion: BodyMotion, i: int) -> BodyMotion:
    """A motion without a leg: the one before it lasts, or the next begins at once."""
    left = [leg for j, leg in enumerate(motion.legs) if j != i]
    if not left:
        return motion
    first = MotionLeg(0, left[0].speed)
    return replace(motion, start=motion.start._replace(v=first.speed), legs=(first, *left[1:]))


def _later(candidate: Candidate, steps: int, tracks: Tracks, dt: float) -> Candidate:
    """A candidate that begins some timesteps later.

    Who of the background departed before is left out; who departs later does so as much earlier.
    """
    poses, shift = tracks.poses[steps], steps * dt

    def moved(body: Trip | Walk) -> float:
        return round(body.time - shift, 3)

    return replace(
        candidate,
        motions=tuple(
            motion.later(pose, steps) for motion, pose in zip(candidate.motions, poses, strict=True)
        ),
        waited=(),
        trips=tuple(t._replace(time=moved(t)) for t in candidate.trips if moved(t) >= 0.0),
        walks=tuple(w._replace(time=moved(w)) for w in candidate.walks if moved(w) >= 0.0),
        entry=tracks.entries[steps],
        cut=candidate.cut + steps,
    )


def _rounder(motion: BodyMotion, kind: Kind, dt: float) -> Iterator[BodyMotion]:
    """A motion with one rounder number; the nominal speed of a pedestrian is round enough."""
    start, second = motion.start, max(1, round(1.0 / dt))
    for digits in PLACES:
        yield replace(
            motion, start=start._replace(x=round(start.x, digits), y=round(start.y, digits))
        )
        yield replace(motion, start=start._replace(x=round(start.x, digits)))
        yield replace(motion, start=start._replace(y=round(start.y, digits)))
    for angle in ANGLES:
        heading = math.radians(round(math.degrees(start.o) / angle) * angle)
        yield replace(motion, start=start._replace(o=heading))
    for i, (step, speed) in enumerate(motion.legs):
        for unit in (second, second // 2):
            if i and unit:
                yield _leg(motion, i, MotionLeg(max(1, round(step / unit) * unit), speed))
        nominal = kind.name in WALKING and speed == kind.v_max
        for digits in () if nominal else PLACES[:2]:
            yield _leg(motion, i, MotionLeg(step, round(speed, digits)))


def _leg(motion: BodyMotion, i: int, leg: MotionLeg) -> BodyMotion:
    """A motion with another leg; the start has the speed of the first."""
    legs = (*motion.legs[:i], leg, *motion.legs[i + 1 :])
    start = motion.start._replace(v=leg.speed) if i == 0 else motion.start
    return replace(motion, start=start, legs=legs)
