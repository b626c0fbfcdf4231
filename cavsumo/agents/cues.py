"""Moments at which a programmed body begins or goes on: by the ego's place or by its reaction.

A cue is a number or a word. A number is a zone: the cue comes when the gap that an ego at its
present speed has left is the braking distance at ``triggers.MAX_DECEL`` and so many times the way
of ``triggers.REACTION_TIME``. A word is a reaction of the ego: it begins to brake, or it has braked
and begins to gain speed again. Reactions are read from nothing but the speed that the agent sees.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from cavsumo.agents.triggers import MAX_DECEL, REACTION_TIME
from cavsumo.model.snapshot import Snapshot

Cue = float | str
BRAKES, SPEEDS_UP = "brakes", "speeds up"
REACTIONS = (BRAKES, SPEEDS_UP)

LONGEST_WAIT_S = 8.0  # a body that waits for the ego goes on after this time
# Changes of speed that are a reaction [m/s]: more than SUMO's drivers dawdle in a timestep.
LOST_MPS, GAINED_MPS = 0.8, 0.5


def zone_m(zone: float, v: float) -> float:
    """A zone as a distance ahead of an ego of a speed [m]."""
    return 0.5 * v * v / MAX_DECEL + zone * REACTION_TIME * v


def in_phase(time: float, phase: float, every: float, dt: float) -> bool:
    """Whether a timestep is the first one from a moment on that returns every so many seconds.

    Always where an ego decides in every timestep (``every`` is not longer than ``dt``).
    """
    return every <= dt or (time - phase + 1e-6) % every < dt - 1e-6


class EgoReactions:
    """Follows the ego's speed in one episode.

    Attributes:
        now: the present one of ``REACTIONS``; None until it brakes for the first time.
    """

    def __init__(self) -> None:
        self.now: str | None = None
        self._extreme = -math.inf  # the highest speed since it gained, or the lowest since it lost

    def see(self, snapshot: Snapshot) -> None:
        """Take in a snapshot; without effect when the ego is not seen."""
        if not snapshot.sees_ego:
            return
        v = snapshot.ego.v
        braking = self.now == BRAKES
        self._extreme = min(self._extreme, v) if braking else max(self._extreme, v)
        if braking and v >= self._extreme + GAINED_MPS:
            self.now, self._extreme = SPEEDS_UP, v
        elif not braking and v <= self._extreme - LOST_MPS:
            self.now, self._extreme = BRAKES, v


class Awaited:
    """A reaction of the ego that a body waits for from now on.

    Args:
        delay: time between the reaction and the cue [s].
    """

    def __init__(self, reaction: str, delay: float = 0.0) -> None:
        self.reaction, self.delay = reaction, delay
        self._at = math.inf

    def came(self, reactions: EgoReactions, time: float) -> bool:
        """Whether the cue has come; to be asked in every timestep."""
        if self._at == math.inf and reactions.now == self.reaction:
            self._at = time
        return time >= self._at + self.delay - 1e-9


class Pause:
    """The time from standing until going on, in one episode.

    Args:
        least: how long a body stands at least [s].
        resume: it stands on until this cue; None: no longer.
    """

    def __init__(self, least: float, resume: Cue | None) -> None:
        self.least, self.resume = least, resume
        self._begun: float | None = None
        self._awaited: Awaited | None = None

    def over(self, snapshot: Snapshot, reactions: EgoReactions, gap: Callable[[], float]) -> bool:
        """Whether the body goes on; the pause begins with the first question.

        ``gap``: asked for the gap that the ego has left as they meet [m].
        """
        resume, time = self.resume, snapshot.time
        if self._begun is None:
            self._begun = time
            if isinstance(resume, str):
                self._awaited = Awaited(resume)
        reacted = self._awaited is not None and self._awaited.came(reactions, time)
        waited = time - self._begun
        if waited < self.least - 1e-9:
            return False
        if resume is None or waited >= LONGEST_WAIT_S:
            return True
        if isinstance(resume, str):
            return reacted
        return gap() <= zone_m(resume, snapshot.ego.v)
