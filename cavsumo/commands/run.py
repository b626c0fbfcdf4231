"""``cavsumo run``: a batch of episodes into a results file, from the start or from where it is."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cavsumo.egos import make_ego
from cavsumo.errors import CavsumoError, Exit, InputError, ResultsError
from cavsumo.executors import Means, opened
from cavsumo.interrupts import Interrupts
from cavsumo.recorder import Recorder
from cavsumo.results import read_manifest
from cavsumo.scenario import plan_from
from cavsumo.session import Session
from cavsumo.setting import Setting, differences, manifest, prepare
from cavsumo.stopping import looks_at_rows
from cavsumo.summary import summarise
from cavsumo.worker import rehearse


@dataclass(frozen=True)
class Manner:
    """How a run treats the results that lie there, and what it says.

    Attributes:
        resume: go on where they end.
        retry_errors: play the episodes again that could not be played.
        overwrite: start again even in place of an unfinished batch.
        quiet: no progress, no summary.
        exit_zero: a violation is no failure.
    """

    resume: bool = False
    retry_errors: bool = False
    overwrite: bool = False
    quiet: bool = False
    exit_zero: bool = False


def run(settings: Mapping[str, Any], output: Path, means: Means, manner: Manner) -> int:
    """Play a batch; everything is checked before anything is written."""
    _check_output(output)
    recorded = _recorded(output, manner)
    plan = plan_from({**_settings_of(recorded), **settings}, "run")
    setting = prepare(plan)
    now = manifest(setting)
    _check_same(output, recorded, now)
    with opened(means) as (executor, jobs), Interrupts(manner.quiet) as interrupts:
        _rehearse(executor, setting)
        with Recorder(output) as recorder:
            session = Session(setting, recorder, executor, jobs, interrupts, manner.quiet)
            if recorded is None:
                session.begin(now, overwrite=manner.overwrite)
            else:
                session.resume({**recorded, "plan": now["plan"]})
            if not manner.quiet:
                print(_first_line(setting, jobs), file=sys.stderr)
            _play(session, manner)
    if not manner.quiet:
        summarise(
            session.tally,
            output,
            recorder.traces,
            sequential=looks_at_rows(plan),
            shared=plan.reset == "shared",
        )
    return _exit_status(session, interrupts(), manner.exit_zero)


def _rehearse(executor: Executor, setting: Setting) -> None:
    """Have the setting loaded once, where it will be played."""
    try:
        executor.submit(rehearse, setting).result()
    except CavsumoError:
        raise
    except Exception as error:  # whatever keeps an executor's processes from playing
        raise InputError(f"the executor cannot play: {type(error).__name__}: {error}") from error


def _play(session: Session, manner: Manner) -> None:
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


def _exit_status(session: Session, interrupted: bool, exit_zero: bool) -> int:
    """130 interrupted, 3 an episode could not be run, 1 the ego violated an assertion, else 0."""
    found = session.tally.all
    if interrupted and (session.cut_short or session.status == "interrupted"):
        return Exit.INTERRUPTED
    if found.errors:
        return Exit.NOT_RUN
    return Exit.VIOLATED if found.failures and not exit_zero else Exit.OK


def _check_output(output: Path) -> None:
    """Refuse what cannot become a results file."""
    if not output.parent.is_dir():
        raise InputError(f"output {str(output)!r}: no such folder {str(output.parent)!r}")
    if output.suffix != ".csv":
        raise InputError(f"output {str(output)!r}: expected a name that ends in .csv")
    if output.is_dir() or output.with_suffix("").is_file():
        raise InputError(f"output {str(output)!r}: its place is taken")


def _recorded(output: Path, manner: Manner) -> dict[str, Any] | None:
    """The manifest of the batch to go on with, None for a new one.

    With ``resume`` there may be nothing yet, so that the same command starts and goes on.
    """
    if not (manner.resume or manner.retry_errors):
        return None
    rows = output.is_file() and output.stat().st_size > 0
    if manner.resume and not rows and not output.with_suffix(".json").exists():
        return None  # a kill may leave an empty file
    return read_manifest(output)


def _settings_of(recorded: Mapping[str, Any] | None) -> dict[str, Any]:
    """The settings of a recorded plan; what is not given again stays as it was."""
    if recorded is None:
        return {}
    try:
        plan = dict(recorded["plan"])
        flat = {"routes": "none"} | {k: v for k, v in plan.pop("scenario").items() if v is not None}
        return flat | {k: v for k, v in plan.items() if v is not None}
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ResultsError("the manifest holds no plan to go on with") from error


def _check_same(output: Path, recorded: Mapping[str, Any] | None, now: Mapping[str, Any]) -> None:
    """Refuse to go on with another scenario, seed or version, saying what differs."""
    different = [] if recorded is None else list(differences(recorded, now))
    if different:
        raise ResultsError(f"results {str(output)!r} are of another batch: {'; '.join(different)}")


def _first_line(setting: Setting, jobs: int) -> str:
    """What was chosen, for the user to see."""
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
    return (
        f"cavsumo: agent {' '.join(plan.agents)}, {scenario.testers} {bodies}, "
        f"ego {driver}, network {scenario.name}{where}, traffic {routes}, "
        f"seed {plan.seed}, {plan.runs} episodes an agent{shard}{at_a_time}"
    )
