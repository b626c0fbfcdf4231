"""What happened in a step besides the reward: events, and a summary at the end."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from cavsumo.assertions.base import NOT_TRIGGERED, UNFAIR, VIOLATED, Assertion
from cavsumo.results.columns import measured
from cavsumo.simulation.loop import EpisodeLoop

# The keys of ``info`` with their meaning.
KEYS = {
    "time_s": "simulation time since the ego entered",
    "outcome": "the verdict so far: not_triggered, held, violated, unfair or invalid",
    "events": "what began in this step, as dicts of event (trigger, unfair, violation, contact), "
    "time_s, tester (or the other body), and assertion (but for contacts)",
    "seed": "the episode's seed, as in results.csv (after reset only)",
    "summary": "the columns of results.csv that an episode fills, and decided: whether the verdict "
    "is final (at the end only)",
}


class EventDetector:
    """Follows one episode and says what is new."""

    def __init__(self, loop: EpisodeLoop, assertions: Sequence[Assertion]) -> None:
        self.loop, self._assertions = loop, assertions
        self._known = [NOT_TRIGGERED for _ in assertions]
        self._touched: set[tuple[str, str]] = set()

    def info(self) -> dict[str, Any]:
        """Time, verdict and the events since the last call."""
        events = [*self._verdicts(), *self._contacts()]
        loop = self.loop
        time, outcome = loop.snapshot.time, loop.outcome
        return {"time_s": time, "outcome": outcome, "events": events}

    def summary(self) -> dict[str, Any]:
        """The figures of the episode, as far as it went."""
        figures = measured(self.loop.finished())
        return figures | {"decided": not any(a.pending for a in self._assertions)}

    def _verdicts(self) -> list[dict[str, Any]]:
        """The verdicts that changed."""
        events: list[dict[str, Any]] = []
        for i, assertion in enumerate(self._assertions):
            judgement, before = assertion.judgement, self._known[i]
            if judgement.verdict == before:
                continue
            self._known[i] = judgement.verdict
            told = {"tester": judgement.tester, "assertion": judgement.assertion}
            if before == NOT_TRIGGERED and judgement.triggered:
                events.append({"event": "trigger", "time_s": judgement.trigger_time} | told)
            if judgement.verdict == VIOLATED:
                events.append({"event": "violation", "time_s": judgement.violation_time} | told)
            if judgement.verdict == UNFAIR:
                time = self.loop.snapshot.time
                events.append({"event": "unfair", "time_s": time} | told)
        return events

    def _contacts(self) -> list[dict[str, Any]]:
        """The bodies that the ego began to touch."""
        pairs = self.loop.contacts.ego_pairs
        if len(pairs) == len(self._touched):
            return []
        new = sorted(pairs - self._touched)
        self._touched |= pairs
        time = self.loop.snapshot.time
        return [{"event": "contact", "time_s": time, "tester": other} for _, other in new]
