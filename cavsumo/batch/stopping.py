"""Rules that stop a batch before its last episode.

Where a reference driver judges, the first failure that ends a batch is the first preventable one.

All rules but the budget look at the rows in the order of their numbers only, so that they stop at
the same row however many processes play.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from cavsumo.batch.tally import RATES, Found, Tally
from cavsumo.model.scenario import BatchPlan, half_width
from cavsumo.results.failures import NOT_JUDGED, PREVENTABLE

Rule = Callable[[Tally], str | None]


def stopping_rule(plan: BatchPlan) -> Rule:
    """All rules of a plan as one: the reason to stop now, or None.

    The budget's clock starts here.
    """
    rules: list[Rule] = []
    if plan.first:
        rules.append(_first_failure(plan.reference != "none"))
    if plan.until_tests is not None:
        rules.append(_enough_tests(plan.until_tests))
    if plan.until_half_width is not None:
        rules.append(_narrow_enough(plan.until_half_width, plan.until_rate, tuple(plan.cast)))
    if plan.budget_s is not None:
        rules.append(_budget_spent(plan.budget_s))
    return lambda tally: next((said for rule in rules if (said := rule(tally))), None)


def looks_at_rows(plan: BatchPlan) -> bool:
    """Whether the number of episodes may depend on their results."""
    given = plan.until_tests, plan.until_half_width, plan.budget_s
    return plan.first or any(value is not None for value in given)


def _first_failure(judged: bool) -> Rule:
    kind, name = (PREVENTABLE, "preventable failure") if judged else (NOT_JUDGED, "failure")

    def rule(tally: Tally) -> str | None:
        row = tally.first.get(kind)
        return None if row is None else f"first {name}: run {row['run']}"

    return rule


def _enough_tests(wanted: int) -> Rule:
    def rule(tally: Tally) -> str | None:
        tests = tally.all.tests
        return f"{tests} tests found" if tests >= wanted else None

    return rule


def _narrow_enough(text: str, name: str, agents: Sequence[str]) -> Rule:
    """Stop when the mean half-width of every agent's interval is small enough."""
    assert name in RATES
    limit, relative = half_width(text)

    def rule(tally: Tally) -> str | None:
        for found in (tally.agents.get(agent, Found()) for agent in agents):
            rate = found.rate(name, sequential=True)
            if rate.value is None or rate.low is None or rate.high is None:
                return None
            if (rate.high - rate.low) / 2 > (limit * rate.value if relative else limit):
                return None
        return f"rate of {name} known to a half-width of {text}"

    return rule


def _budget_spent(seconds: float) -> Rule:
    end = time.monotonic() + seconds

    def rule(tally: Tally) -> str | None:
        return f"budget of {seconds:g} s spent" if time.monotonic() >= end else None

    return rule
