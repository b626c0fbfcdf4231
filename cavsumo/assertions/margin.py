"""Assertions defined by a margin that the ego keeps while a precondition holds.

The precondition triggers when a margin is first given, the assertion is violated when one is below
zero for longer than a grace period, and the robustness is the smallest. With a grace period g it is
min over t of max over [t - g, t], the robustness of "always, within g, margin >= 0" (Fainekos and
Pappas 2009), so its sign is the verdict here too.
"""

from __future__ import annotations

import dataclasses
from collections import deque
from collections.abc import Iterable, Sequence

from cavsumo.assertions.base import (
    HELD,
    NOT_TRIGGERED,
    VIOLATED,
    Assertion,
    Judgement,
)
from cavsumo.assertions.contacts import Contact
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

Margin = tuple[str, float]  # the body involved (empty for none) and the margin in ``unit``


class MarginAssertion(Assertion):
    """Base of assertions that give a margin for each body for which the precondition holds.

    After a violation it continues until the precondition ends or the ego touches a body, so that
    the robustness measures the whole violation.

    Attributes:
        grace_s: time for which a margin may stay below zero [s].
    """

    grace_s: float = 0.0

    def reset(self, scene: Scene) -> None:
        super().reset(scene)
        if self.unconditional:
            self.judgement = Judgement(self.name, HELD, trigger_time=0.0)
        self._recent: dict[str, deque[tuple[float, float]]] = {}
        self._last: Snapshot | None = None

    def margins(self, snapshot: Snapshot, before: Snapshot | None) -> Iterable[Margin]:
        """The margins at this moment, none where the precondition does not hold.

        ``before`` is the snapshot before, None in the first one.
        """
        raise NotImplementedError

    def observe(self, snapshot: Snapshot, contacts: Sequence[Contact]) -> None:
        if self.decided:
            return
        found = list(self.margins(snapshot, self._last))
        self._last = snapshot
        for who, margin in found:
            self._take(snapshot, who, self._lasting(who, margin, snapshot.time))
        self._recent = {who: self._recent[who] for who, _ in found if who in self._recent}
        if self.judgement.verdict == VIOLATED:
            touched = any(contact.a is snapshot.ego for contact in contacts)
            self.decided = touched or not found

    def _lasting(self, who: str, margin: float, now: float) -> float:
        """The largest margin during the grace period; at least 0 before that is over."""
        if not self.grace_s:
            return margin
        recent = self._recent.setdefault(who, deque())
        recent.append((now, margin))
        begun = recent[0][0]
        while len(recent) > 1 and recent[1][0] <= now - self.grace_s + 1e-9:
            recent.popleft()
        most = max(m for _, m in recent)
        return most if now - begun >= self.grace_s - 1e-9 else max(0.0, most)

    def _take(self, snapshot: Snapshot, who: str, margin: float) -> None:
        """Let a margin count."""
        said = self.judgement
        if said.verdict == NOT_TRIGGERED:
            self.judgement = said = Judgement(
                self.name, HELD, who, trigger_time=snapshot.time, ego_speed=snapshot.ego.v
            )
        if said.robustness is not None and margin >= said.robustness:
            return
        self.judgement = said = dataclasses.replace(said, robustness=margin)
        if margin < 0.0 and said.verdict != VIOLATED:
            self.judgement = dataclasses.replace(
                said,
                verdict=VIOLATED,
                tester=who,
                violation_time=snapshot.time,
                ego_speed=snapshot.ego.v,
            )


def acceleration(snapshot: Snapshot, before: Snapshot | None) -> float:
    """The ego's acceleration over the last timestep [m/s2]; 0 in the first one."""
    if before is None or snapshot.time <= before.time:
        return 0.0
    return (snapshot.ego.v - before.ego.v) / (snapshot.time - before.time)
