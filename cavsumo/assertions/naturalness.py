"""Naturalness of the testers' motion: possible but unusual motion is measured, not forbidden."""

from __future__ import annotations

import math

from cavsumo.model.kinematics import wrap
from cavsumo.model.snapshot import BodyState, Snapshot


class Naturalness:
    """Adds up the testers' accelerations and turns during one episode.

    Attributes:
        turning: sum of their turns, to either side [rad].
    """

    def __init__(self) -> None:
        self.turning = 0.0
        self._squares = 0.0  # of the changes of speed [m2/s2]
        self._testers: tuple[BodyState, ...] = ()

    def observe(self, snapshot: Snapshot) -> None:
        """Take in a snapshot."""
        testers, before = snapshot.testers, self._testers
        if testers is before:  # all stand still
            return
        self._testers = testers
        for old, new in zip(before, testers, strict=False):
            if old is not new:
                gained = new.v - old.v
                self._squares += gained * gained
                if new.o != old.o:
                    self.turning += abs(wrap(new.o - old.o))

    def rms_acceleration(self, steps: int, dt: float) -> float:
        """Root mean square of their accelerations along their headings, over all steps [m/s2]."""
        count = steps * len(self._testers)
        return math.sqrt(self._squares / count) / dt if count else 0.0
