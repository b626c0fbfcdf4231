"""An assertion has a precondition; its verdict is never just pass or fail."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from cavsumo.assertions.contacts import Contact
from cavsumo.assertions.names import ASSERTION_NAMES
from cavsumo.model.registry import Registry
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

# Verdicts, the most serious first: how several assertions make one outcome.
VIOLATED, UNFAIR, HELD, NOT_TRIGGERED = "violated", "unfair", "held", "not_triggered"
INVALID = "invalid"  # of an episode in which a tester broke the rules of the world (``validity``)
SEVERITY = (VIOLATED, UNFAIR, HELD, NOT_TRIGGERED)


@dataclass(frozen=True, slots=True)
class Judgement:
    """What an assertion says of an episode.

    Attributes:
        assertion: its name.
        verdict: ``not_triggered``: the precondition never held; ``held``: it did and the ego
            coped; ``violated``: it did and the ego broke the assertion; ``unfair``: the tester
            left the ego no chance.
        tester: id of the body involved, if any.
        trigger_time, violation_time: when the precondition began to hold, when the assertion was
            broken [s].
        ego_speed: speed of the ego at the violation, else at the trigger [m/s].
        impact_speed: closing speed of a contact [m/s].
        robustness: how far the ego kept from a violation, in the assertion's unit: its smallest
            margin since the trigger, negative if and only if violated; None before the trigger.
    """

    assertion: str
    verdict: str = NOT_TRIGGERED
    tester: str = ""
    trigger_time: float | None = None
    violation_time: float | None = None
    ego_speed: float | None = None
    impact_speed: float | None = None
    robustness: float | None = None

    @property
    def triggered(self) -> bool:
        """Whether the episode was a test in the seed's sense."""
        return self.verdict in (HELD, VIOLATED)


class Assertion:
    """Base of the assertions: watches an episode snapshot by snapshot.

    Attributes:
        name: as registered.
        judgement: what it says so far.
        decided: nothing that follows can change the judgement.
        pending: the precondition held and the verdict is still open, so the episode goes on.
        sees_background: whether it looks at the background traffic or the traffic lights in the
            snapshots; contacts are reported in any case. See ``Agent.sees_background``.
        unconditional: it has no precondition, so that every episode is a test of it. Among several
            assertions that it held makes no episode a test (``weightiest``).
        unit: of the robustness.
    """

    PARAMETERS: ClassVar[Mapping[str, str]] = {}
    sees_background: bool = True
    unconditional: bool = False
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
        """The episode is over: the judgement is final, of what needed all of it, too.

        ``decided`` stays as it is unless the ego broke the assertion only now.
        """


def weightiest(assertions: Sequence[Assertion]) -> Judgement:
    """The judgement that stands for an episode: the most serious, of equal ones the first.

    Unless it is violated, an assertion without a precondition speaks only where there is no other:
    that the ego kept to the speed limit does not make an episode a test of how it meets testers.
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
