"""``cavsumo run``: one batch or several, new or continued."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from cavsumo.batch import sentences
from cavsumo.batch.ended import Ended
from cavsumo.batch.manner import Manner as Manner
from cavsumo.batch.manner import Means
from cavsumo.batch.planned import PlannedBatch, planned
from cavsumo.batch.playing import played
from cavsumo.batch.preflight import CheckedBatch, prepared_batches
from cavsumo.batch.sentences import many
from cavsumo.batch.summary import summarise
from cavsumo.batch.tally import found_by
from cavsumo.cli.steps import SlowSteps
from cavsumo.egos import make_ego
from cavsumo.errors import Exit
from cavsumo.model.study import Part


def run(settings: Mapping[str, Any], output: Path, means: Means, manner: Manner) -> int:
    """Play a batch; all checks precede the first written file."""
    return run_study(planned([Part("", dict(settings))], output, manner), means, manner)


def run_study(
    batches: Sequence[PlannedBatch],
    means: Means,
    manner: Manner,
    head: Callable[[Sequence[Ended]], str] = lambda ended: "",
) -> int:
    """Play one batch after another; all are checked before anything is written.

    ``head``: makes the table of the summary, in place of that of the agents.
    """
    with SlowSteps(quiet=manner.quiet) as steps:
        steps.begin("reading the network and looking for starts")
        checked = prepared_batches(batches, manner)
    for batch in checked:
        if batch.replaced:
            print(_replacement(batch), file=sys.stderr)
    ended, interrupted = played(checked, means, manner, announce)
    status = exit_status(ended, interrupted, manner.exit_zero)
    if not manner.quiet:
        summarise(ended, head(ended))
        if status == Exit.VIOLATED:
            print(f"cavsumo: exit status {status:d}: {_reason(ended)}", file=sys.stderr)
    return status


def exit_status(ended: Sequence[Ended], interrupted: bool, exit_zero: bool) -> int:
    """130 interrupted, 3 an episode could not be run, 1 the ego violated an assertion, else 0.

    It is 1 whether that was preventable or not: what the ego did is known, what another driver
    would have done is a judgement.
    """
    if interrupted:
        return Exit.INTERRUPTED
    found = [one.tally.all for one in ended]
    if any(one.errors for one in found):
        return Exit.NOT_RUN
    violated = any(one.failures for one in found)
    return Exit.VIOLATED if violated and not exit_zero else Exit.OK


def _reason(ended: Sequence[Ended]) -> str:
    """The meaning of exit status 1, the preventable failures first."""
    judged = all(one.judged for one in ended)
    return sentences.exit_reason(found_by(one.tally.all for one in ended), judged)


def announce(batch: CheckedBatch, jobs: int) -> None:
    """Print the chosen scenario on stderr."""
    print(_first_line(batch, jobs), file=sys.stderr)


def _replacement(batch: CheckedBatch) -> str:
    """A line about the results that a batch replaces."""
    return (
        f"cavsumo: {str(batch.output)!r}: another batch of {batch.replaced} episodes is replaced; "
        "-o FILE keeps the next one"
    )


def _first_line(batch: CheckedBatch, jobs: int) -> str:
    """The chosen scenario in a line."""
    prepared = batch.prepared
    plan, scenario, route = prepared.plan, prepared.plan.scenario, prepared.site.route
    ego = make_ego(scenario.ego, scenario.ego_params)
    attributes = " ".join(f"{k}={v}" for k, v in getattr(ego, "attributes", {}).items())
    driver = f"{scenario.ego} ({attributes})" if attributes else scenario.ego
    where = f" junction {route.junction}" if route.junction else ""
    routes = scenario.routes.name if scenario.routes else "none"
    if scenario.traffic is not None:
        routes = "{:g},{:g} per minute and km".format(*scenario.traffic)
    shard = f", shard {plan.shard}" if plan.shard else ""
    bodies = "buses" if scenario.kind == "bus" else f"{scenario.kind}s"
    at_a_time = f", {jobs} at a time" if jobs > 1 else ""
    part = f"{batch.name}: " if batch.name else ""
    if plan.suite is not None:
        return (
            f"cavsumo: suite {plan.suite.name}, ego {driver}, seed {plan.seed}, "
            f"{many(plan.runs, 'case')}{shard}{at_a_time}"
        )
    return (
        f"cavsumo: {part}agent {' '.join(plan.agents)}, {scenario.testers} {bodies}, "
        f"ego {driver}, network {scenario.name}{where}, traffic {routes}, "
        f"seed {plan.seed}, {plan.runs} episodes an agent{shard}{at_a_time}"
    )
