"""Verdicts, and what an assertion says of an episode; nothing heavy is imported."""

from __future__ import annotations

from dataclasses import dataclass

# Verdicts, the most serious first: how several assertions make one outcome.
VIOLATED, UNFAIR, HELD, NOT_TRIGGERED = "violated", "unfair", "held", "not_triggered"
INVALID = "invalid"  # of an episode in which a tester broke the rules of the world (``validity``)
SEVERITY = (VIOLATED, UNFAIR, HELD, NOT_TRIGGERED)


@dataclass(frozen=True, slots=True)
class Judgement:
    """The judgement of an assertion about an episode.

    Attributes:
        assertion: its name.
        verdict: ``not_triggered``: the precondition never held; ``held``: it did and the ego
            satisfied the assertion; ``violated``: it did and the ego violated the assertion;
            ``unfair``: the ego could not have avoided the contact.
        tester: id of the body involved, if any.
        trigger_time, violation_time: when the precondition began to hold, when the assertion was
            violated [s].
        ego_speed: speed of the ego at the violation, else at the trigger [m/s].
        impact_speed: closing speed of a contact [m/s].
        robustness: the ego's smallest margin to a violation since the trigger, in the assertion's
            unit, negative if and only if violated; None before the trigger.
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
