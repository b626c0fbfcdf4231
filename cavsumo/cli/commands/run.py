"""``cavsumo run``: one batch or several, from the start or from where they are."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

from cavsumo.agents.casting import make_agents
from cavsumo.batch.batch_run import Session
from cavsumo.batch.executors import Means, opened
from cavsumo.batch.interrupts import Interrupts
from cavsumo.batch.preflight import Checked, Manner, checked
from cavsumo.batch.prepared import Setting
from cavsumo.batch.stopping import looks_at_rows
from cavsumo.batch.summary import Ended, summarise
from cavsumo.batch.worker import rehearse
from cavsumo.egos import make_ego
from cavsumo.errors import CavsumoError, Exit, InputError
from cavsumo.model.study import Part
from cavsumo.results.writing import Recorder


def run(settings: Mapping[str, Any], output: Path, means: Means, manner: Manner) -> int:
    """Play a batch; everything is checked before anything is written."""
    return run_study([Part("", dict(settings))], output, means, manner)


def run_study(parts: Sequence[Part], output: Path, means: Means, manner: Manner) -> int:
    """Play one batch after another; all are checked before anything is written."""
    ended, interrupted = played(checked(parts, output, manner), means, manner)
    if not manner.quiet:
        summarise(ended)
    return exit_status(ended, interrupted, manner.exit_zero)


def played(batches: Sequence[Checked], means: Means, manner: Manner) -> tuple[list[Ended], bool]:
    """Play batches that were checked; what they came to, and whether that was cut short."""
    ended: list[Ended] = []
    with opened(means) as (executor, jobs), Interrupts(manner.quiet) as interrupts:
        for batch in batches:
            _rehearse(executor, batch.setting)
        for batch in batches:
            if interrupts() and ended:
                break
            ended.append(_play(batch, executor, jobs, interrupts, manner))
    cut_short = len(ended) < len(batches) or any(one.cut_short for one in ended)
    return ended, interrupts() and cut_short


def _rehearse(executor: Executor, setting: Setting) -> None:
    """Have the setting loaded once, where it will be played."""
    try:
        executor.submit(rehearse, setting).result()
    except CavsumoError:
        raise
    except Exception as error:  # whatever keeps an executor's processes from playing
        raise InputError(f"the executor cannot play: {type(error).__name__}: {error}") from error


def _play(
    batch: Checked, executor: Executor, jobs: int, interrupts: Interrupts, manner: Manner
) -> Ended:
    """Play a batch into its file, or what is left of it."""
    setting = batch.setting
    with Recorder(batch.output) as recorder:
        session = Session(setting, recorder, executor, jobs, interrupts, manner.quiet)
        if batch.recorded is None:
            session.begin(batch.manifest, overwrite=manner.overwrite)
        else:
            session.resume({**batch.recorded, "plan": batch.manifest["plan"]})
        if not manner.quiet:
            print(_first_line(batch, jobs), file=sys.stderr)
        _carry_out(session, manner)
    return Ended(
        batch.name,
        batch.output,
        session.tally,
        recorder.traces,
        sequential=looks_at_rows(setting.plan),
        shared=setting.plan.reset == "shared",
        cut_short=session.cut_short or session.status == "interrupted",
        promises={n: make_agents(setting.plan, n)[0].promise for n in setting.plan.cast},
    )


def _carry_out(session: Session, manner: Manner) -> None:
    """Do what was asked for, and complete the manifest whatever happens."""
    try:
        if manner.retry_errors:
            session.retry()
        if manner.resume or not manner.retry_errors:
            session.play()
    except KeyboardInterrupt:  # twice: what runs is given up
        session.status = "interrupted"
    finally:
        session.end()


def exit_status(ended: Sequence[Ended], interrupted: bool, exit_zero: bool) -> int:
    """130 interrupted, 3 an episode could not be run, 1 the ego violated an assertion, else 0."""
    if interrupted:
        return Exit.INTERRUPTED
    found = [one.tally.all for one in ended]
    if any(one.errors for one in found):
        return Exit.NOT_RUN
    violated = any(one.failures for one in found)
    return Exit.VIOLATED if violated and not exit_zero else Exit.OK


def _first_line(batch: Checked, jobs: int) -> str:
    """What was chosen, for the user to see."""
    setting = batch.setting
    plan, scenario, route = setting.plan, setting.plan.scenario, setting.site.route
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
