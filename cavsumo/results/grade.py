"""The grade of an episode: how near it came to a preventable failure, as one number.

Every episode has one, triggered or not, so a search can climb from nobody met to a hard impact:

==========  ====================================================================================
[0, inf)    a preventable failure: the impact speed [m/s], else the robustness lost
[-1, 0)     a failure that was not preventable: -s / (1 + s) for s seconds that the reference
            driver was short of
[-2, -1)    met, and held: -1 - t / (1 + t) for a margin of t seconds
[-3, -2)    unfair: somebody came too late for anyone: -2 - s / (1 + s) for s seconds too late
[-4, -3)    nobody met: -3 - t / (1 + t) for a margin of t seconds
-5          invalid: a tester broke the rules of the world
==========  ====================================================================================

The margin is the smallest gap between the moving ego and a tester that is not behind it, in the
time that the ego needs for it: who passes somebody closely and fast has as little of it as who
stops late.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from cavsumo.assertions.contacts import STANDING_MPS
from cavsumo.assertions.judgement import HELD, INVALID, UNFAIR, VIOLATED
from cavsumo.model.geometry import gap

if TYPE_CHECKING:
    from cavsumo.model.snapshot import BodyState
    from cavsumo.simulation.avoidability import Avoidability
    from cavsumo.simulation.episode import Episode

INVALID_GRADE = -5.0
MOST_S = 10.0  # a larger margin counts as this one, and so does a time that is not known
SLOWEST_MPS = 1.0  # a slower ego counts as so fast


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
        return -1.0 - _share(_margin(episode))
    if said.verdict == UNFAIR:
        return -2.0 - _share(_late(episode))
    return -3.0 - _share(_margin(episode))


def _share(seconds: float) -> float:
    """A time from 0 on, as a number from 0 up to 1."""
    return seconds / (1.0 + seconds)


def _margin(episode: Episode) -> float:
    """How far the moving ego and the testers were apart, at most ``MOST_S`` [s]."""
    least = MOST_S
    for snapshot in episode.seen:
        ego = snapshot.ego
        if ego.v <= STANDING_MPS:
            continue
        v = max(SLOWEST_MPS, ego.v)
        for tester in snapshot.testers:
            apart = math.hypot(tester.x - ego.x, tester.y - ego.y)
            near = apart - ego.body.kind.reach - tester.body.kind.reach < least * v
            if near and not _passed(ego, tester):
                least = min(least, gap(ego.box, tester.box) / v)
    return least


def _passed(ego: BodyState, tester: BodyState) -> bool:
    """Whether a whole tester lies behind the ego's rear bumper."""
    ahead = (tester.x - ego.x) * math.cos(ego.o) + (tester.y - ego.y) * math.sin(ego.o)
    return ahead + tester.body.kind.reach < -ego.body.kind.length / 2


def _short(avoidability: Avoidability) -> float:
    """How much earlier the reference driver had to perceive the risk [s]."""
    perceived, last = avoidability.perceived, avoidability.last_chance
    return MOST_S if perceived is None or last is None else max(0.0, perceived - last)


def _late(episode: Episode) -> float:
    """How much earlier a body that came too late had to come for a human driver to stop [s].

    That driver loses as much speed as if it braked fully after its delay and half of the rise.
    """
    # The columns, which need this file, are read where nothing heavy may be imported.
    from cavsumo.egos.reference.encounter import EVALUATION_S
    from cavsumo.egos.reference.human import DELAY_S, FULL_MPS2, RISE_S

    reaction = EVALUATION_S + DELAY_S + RISE_S / 2
    v, apart = episode.judgement.ego_speed or 0.0, episode.contacts.min_gap
    left = apart / v if v > 0.0 and math.isfinite(apart) else 0.0
    return max(0.0, v / (2.0 * FULL_MPS2) + reaction - left)
