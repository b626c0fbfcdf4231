"""The grade of an episode: how near it came to a preventable failure, as one number.

Every episode has one, triggered or not, so a search can climb from nobody met to a hard impact:

==========  ====================================================================================
[0, inf)    a preventable failure: the impact speed [m/s], else the robustness lost
[-1, 0)     a failure that was not preventable: -s / (1 + s) for s seconds that the reference
            driver was short of
[-2, -1)    met, and held: -1 - t / (1 + t), where t is the spare time of the ego, or what a human
            driver was short of if that is more
[-3, -2)    unfair: somebody came too late for anyone: -2 - s / (1 + s) for s seconds too late
[-4, -3)    nobody met: -3 - t / (1 + t) for a spare time of t seconds
-5          invalid: a tester broke the rules of the world
==========  ====================================================================================

The spare time is the least over the episode of how long the moving ego could still have waited
before it had to brake fully to stop before a tester, or of how long that tester would still need
to come into its strip, if that is longer. A tester that is in the strip as far ahead as the ego
needs to stop, and one beside the ego that touches it, both leave no time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from cavsumo.assertions.contacts import STANDING_MPS
from cavsumo.assertions.judgement import HELD, INVALID, UNFAIR, VIOLATED
from cavsumo.model.bodies import SIDEWAYS_MPS2, WALKING
from cavsumo.model.geometry import Point, corners, in_frame
from cavsumo.model.zone_presence import drift

if TYPE_CHECKING:
    from cavsumo.model.snapshot import BodyState
    from cavsumo.simulation.avoidability import Avoidability
    from cavsumo.simulation.episode import Episode

INVALID_GRADE = -5.0
MOST_S = 10.0  # a larger margin counts as this one, and so does a time that is not known
SLOWEST_MPS = 1.0  # a slower ego counts as so fast
BRAKES_MPS2 = 9.0  # fully, as the reaction zone assumes


def grade(episode: Episode, avoidability: Avoidability | None) -> float:
    """The grade of an episode; ``avoidability`` is None where no reference driver judged it."""
    said = episode.judgement
    if episode.outcome == INVALID:
        return INVALID_GRADE
    if said.verdict == VIOLATED and (avoidability is None or avoidability.avoidable):
        lost = -(said.robustness or 0.0)
        return max(0.0, lost if said.impact_speed is None else said.impact_speed)
    if said.verdict == VIOLATED:
        assert avoidability is not None
        return -_share(_short(avoidability))
    if said.verdict == HELD and said.tester:
        return -1.0 - _share(max(_spare(episode), episode.short or 0.0))
    if said.verdict == UNFAIR:
        return -2.0 - _share(MOST_S if episode.short is None else episode.short)
    return -3.0 - _share(_spare(episode))


def _share(seconds: float) -> float:
    """A time from 0 on, as a number from 0 up to 1."""
    return seconds / (1.0 + seconds)


def _spare(episode: Episode) -> float:
    """The spare time of the ego, at most ``MOST_S`` [s]."""
    least = MOST_S
    for snapshot in episode.seen:
        ego = snapshot.ego
        if ego.v <= STANDING_MPS:
            continue
        cos, sin, own, v = math.cos(ego.o), math.sin(ego.o), ego.body.kind, max(SLOWEST_MPS, ego.v)
        room = own.length / 2 + v * v / (2.0 * BRAKES_MPS2)
        for tester in snapshot.testers:
            dx, dy, reach = tester.x - ego.x, tester.y - ego.y, tester.body.kind.reach
            ahead, walks = dx * cos + dy * sin, tester.body.kind.name in WALKING
            far = room + reach + least * v + (0.0 if walks else tester.v * v / BRAKES_MPS2)
            # not passed, and perhaps nearer than any before
            if not -own.length / 2 - reach <= ahead < far:
                continue
            if walks:
                beside = abs(dy * cos - dx * sin) - own.width / 2
                least = min(least, _left(tester, ego.o, ahead - room, beside, v))
            else:
                least = min(least, _left_by_vehicle(tester, ego, room, v))
    return least


def _left(tester: BodyState, heading: float, ahead: float, beside: float, v: float) -> float:
    """How long the centre of a tester, so far beyond the stopping way and beside it, leaves [s]."""
    from cavsumo.agents.driving import extent  # the columns are read where shapely is not loaded

    along, across = extent(tester, heading)
    return max(0.0, (ahead - along) / v, (beside - across) / tester.body.kind.v_max)


def _left_by_vehicle(tester: BodyState, ego: BodyState, room: float, v: float) -> float:
    """How long a vehicle leaves an ego at a speed that stops within its room [s].

    It counts where it will be (``zone_presence``), and comes aside by steering: from its speed to
    the side on with the acceleration that tyres hold.
    """
    seen, half = in_frame(tester.box, ego.x, ego.y, ego.o), ego.body.kind.width / 2
    shift = drift(tester.v * math.cos(seen.heading), ego.v, BRAKES_MPS2)
    points, leftwards = corners(seen), tester.v * math.sin(seen.heading)
    right, left = min(y for _, y in points), max(y for _, y in points)
    ahead = min(x for x, _ in points)
    if right > half:
        aside = _time_aside(right - half, -leftwards)
    elif left < -half:
        aside = _time_aside(-half - left, leftwards)
    else:
        aside, ahead = 0.0, _nearest(points, half)
    return max(0.0, (ahead + shift - room) / v, aside)


def _time_aside(way: float, towards: float) -> float:
    """How long a vehicle takes for a way to the side, with a speed towards it [s]."""
    gained = math.sqrt(towards * towards + 2.0 * SIDEWAYS_MPS2 * way) - towards
    return gained / SIDEWAYS_MPS2


def _nearest(points: Sequence[Point], half: float) -> float:
    """The least x of that part of a convex area at which y is at most so far from 0 [m]."""
    xs = [x for x, y in points if abs(y) <= half]
    for (x, y), (u, w) in zip(points, (*points[1:], points[0]), strict=True):
        for side in (-half, half):
            if (y - side) * (w - side) < 0.0:
                xs.append(x + (u - x) * (side - y) / (w - y))
    return min(xs)


def _short(avoidability: Avoidability) -> float:
    """How much earlier the reference driver had to perceive the risk [s]."""
    perceived, last = avoidability.perceived, avoidability.last_chance
    return MOST_S if perceived is None or last is None else max(0.0, perceived - last)
