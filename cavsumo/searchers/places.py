"""Places where bodies of a test can start, relative to the ego's path; shares of intervals."""

from __future__ import annotations

from typing import NamedTuple

from cavsumo.agents.cues import BRAKES, SPEEDS_UP, Cue
from cavsumo.model.carriageway import Start

NEAREST_M = 12.0  # nearer to where the ego enters nobody can meet it in time
RESUMED = (-0.5, 2.5)  # where it is as a body goes on
LONGEST_PAUSE_S = 2.0
LONGEST_DELAY_S = 1.5  # from a reaction of the ego to a body that begins
# Shares of the number "resume" up to which a body goes on after a pause, by the place of the ego,
# as it brakes, and as it gains speed again.
AFTER, AT, AS_IT_BRAKES = 0.4, 0.7, 0.85


class Place(NamedTuple):
    """A place where a body can start.

    Attributes:
        start: there.
        whence: from where it comes, seen from the ego: "from the left", "ahead of the ego" ...
        along: where its way meets the ego's path; 0 for one ahead of the ego or beside it [m].
        lead: how much earlier than the ego a vehicle arrives there, or how far it is ahead [s].
        away: how far a pedestrian is from the strip that the ego sweeps [m].
    """

    start: Start
    whence: str
    along: float
    lead: float = 0.0
    away: float = 0.0

    @property
    def left(self) -> bool:
        """Whether it comes from the left of the ego."""
        return self.whence == FROM_LEFT


FROM_LEFT, FROM_RIGHT = "from the left", "from the right"


def within(bounds: tuple[float, float], share: float) -> float:
    """The number at a share of an interval."""
    return bounds[0] + share * (bounds[1] - bounds[0])


def pause_of(resume: float) -> tuple[float, Cue | None]:
    """How long a body stands at least [s] and until which cue, by its number "resume"."""
    if resume <= AFTER:
        return max(0.0, resume - 0.1) / (AFTER - 0.1) * LONGEST_PAUSE_S, None
    if resume <= AT:
        return 0.0, within(RESUMED, (resume - AFTER) / (AT - AFTER))
    return 0.0, BRAKES if resume <= AS_IT_BRAKES else SPEEDS_UP
