"""``cavsumo run``: one batch or several, from the start or from where they are."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from cavsumo.batch.executors import Means
from cavsumo.batch.playing import played
from cavsumo.batch.preflight import CheckedBatch, Manner, checked
from cavsumo.batch.summary import Ended, summarise
from cavsumo.egos import make_ego
from cavsumo.errors import Exit
from cavsumo.model.study import Part


def run(settings: Mapping[str, Any], output: Path, means: Means, manner: Manner) -> int:
    """Play a batch; everything is checked before anything is written."""
    return run_study([Part("", dict(settings))], output, means, manner)


def run_study(parts: Sequence[Part], output: Path, means: Means, manner: Manner) -> int:
    """Play one batch after another; all are checked before anything is written."""
    ended, interrupted = played(checked(parts, output, manner), means, manner, announce)
    if not manner.quiet:
        summarise(ended)
    return exit_status(ended, interrupted, manner.exit_zero)


def exit_status(ended: Sequence[Ended], interrupted: bool, exit_zero: bool) -> int:
    """130 interrupted, 3 an episode could not be run, 1 the ego violated an assertion, else 0."""
    if interrupted:
        return Exit.INTERRUPTED
    found = [one.tally.all for one in ended]
    if any(one.errors for one in found):
        return Exit.NOT_RUN
    violated = any(one.failures for one in found)
    return Exit.VIOLATED if violated and not exit_zero else Exit.OK


def announce(batch: CheckedBatch, jobs: int) -> None:
    """Say on stderr what was chosen."""
    print(_first_line(batch, jobs), file=sys.stderr)


def _first_line(batch: CheckedBatch, jobs: int) -> str:
    """What was chosen, for the user to see."""
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
    return (
        f"cavsumo: {part}agent {' '.join(plan.agents)}, {scenario.testers} {bodies}, "
        f"ego {driver}, network {scenario.name}{where}, traffic {routes}, "
        f"seed {plan.seed}, {plan.runs} episodes an agent{shard}{at_a_time}"
    )
