"""An assertion has a precondition; its verdict is never just pass or fail."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

from cavsumo.assertions.contacts import Contact
from cavsumo.assertions.judgement import HELD as HELD  # the protocol has all of these
from cavsumo.assertions.judgement import INVALID as INVALID
from cavsumo.assertions.judgement import NOT_TRIGGERED as NOT_TRIGGERED
from cavsumo.assertions.judgement import SEVERITY as SEVERITY
from cavsumo.assertions.judgement import UNFAIR as UNFAIR
from cavsumo.assertions.judgement import VIOLATED as VIOLATED
from cavsumo.assertions.judgement import Judgement as Judgement
from cavsumo.assertions.names import ASSERTION_NAMES
from cavsumo.model.registry import Registry
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot


class Assertion:
    """Base of the assertions, which evaluate an episode snapshot by snapshot.

    Attributes:
        name: as registered.
        judgement: the judgement so far.
        decided: no later snapshot can change the judgement.
        pending: the precondition held and the verdict is still open, so the episode goes on.
        sees_background: whether it looks at the background traffic or the traffic lights in the
            snapshots; contacts are reported in any case. See ``Agent.sees_background``.
        unconditional: it has no precondition, so that every episode is a test of it. Among several
            assertions its verdict ``held`` does not make an episode a test (``weightiest``).
        about_testers: while it is not pending, only a tester ahead of the ego or beside it can
            change the judgement; so nothing does once all of them are left behind.
        unit: of the robustness.
    """

    PARAMETERS: ClassVar[Mapping[str, str]] = {}
    sees_background: bool = True
    unconditional: bool = False
    about_testers: bool = False
    unit: ClassVar[str] = ""
    name: ClassVar[str]

    judgement: Judgement
    decided: bool
    pending: bool

    def reset(self, scene: Scene) -> None:
        """Begin an episode."""
        self.scene = scene
        self.judgement = Judgement(self.name)
        self.decided = self.pending = False

    def observe(self, snapshot: Snapshot, contacts: Sequence[Contact]) -> None:
        """Take in a snapshot and the contacts that begin in it."""
        raise NotImplementedError

    def conclude(self) -> None:
        """End the episode: the judgement becomes final.

        ``decided`` keeps its value unless the assertion is violated only now.
        """


def weightiest(assertions: Sequence[Assertion]) -> Judgement:
    """The judgement that stands for an episode: the most serious, of equal ones the first.

    An assertion without a precondition counts only if it is violated or alone: an ego that keeps to
    the speed limit does not make an episode a test of how it meets testers.
    """
    conditional = any(not a.unconditional for a in assertions)
    heard = [
        a.judgement
        for a in assertions
        if not (conditional and a.unconditional and a.judgement.verdict != VIOLATED)
    ]
    return min(heard, key=_weight)


def _weight(said: Judgement) -> tuple[int, float]:
    """Sort key: the most serious first, then the earliest."""
    when = said.trigger_time if said.violation_time is None else said.violation_time
    return SEVERITY.index(said.verdict), math.inf if when is None else when


ASSERTIONS: Registry[Assertion] = Registry(ASSERTION_NAMES)
