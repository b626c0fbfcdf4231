"""The commands of the command line that simulate: run and replay."""

from __future__ import annotations

import dataclasses
import hashlib
import importlib.metadata
import platform
import sys
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cavsumo import __version__
from cavsumo.assertions import ASSERTIONS
from cavsumo.batch import Worker, run_batch
from cavsumo.bodies import kind_named
from cavsumo.egos import make_ego
from cavsumo.errors import Exit, InputError
from cavsumo.jobs import check_agents, job, make_agents
from cavsumo.options import OPTIONS
from cavsumo.outcomes import Outcome, ResultsWriter, Row, is_failure
from cavsumo.progress import Progress
from cavsumo.replays import first_difference, recorded_frames, recorded_plan, recorded_row
from cavsumo.scenario import BatchPlan, plan_from
from cavsumo.site import Site, derive_site
from cavsumo.summary import summarise

ON_PAVEMENTS = ("pedestrian", "bicycle")  # kinds of body that may start there


def run(settings: Mapping[str, Any], output: Path, quiet: bool, exit_zero: bool) -> int:
    """``cavsumo run``: everything is checked before anything is written."""
    plan = plan_from(settings, "run")
    site = prepare(plan)
    if plan.scenario.kind not in ON_PAVEMENTS:
        raise InputError(
            f"kind {plan.scenario.kind!r}: testers start on pavements, where only "
            f"{' and '.join(ON_PAVEMENTS)} can be"
        )
    _check_output(output)
    with Worker(plan, site) as worker:
        if not quiet:
            print(_first_line(plan, site), file=sys.stderr)
        writer = ResultsWriter(output, manifest(plan, site))
        rows, status = _play(plan, worker, writer, quiet)
    if not quiet:
        summarise(rows, output, writer.traces)
    return status or exit_status(rows, exit_zero)


def _check_output(output: Path) -> None:
    """Refuse what cannot become a results file."""
    if not output.parent.is_dir():
        raise InputError(f"output {str(output)!r}: no such folder {str(output.parent)!r}")
    if output.suffix != ".csv":
        raise InputError(f"output {str(output)!r}: expected a name that ends in .csv")
    if output.is_dir() or output.with_suffix("").is_file():
        raise InputError(f"output {str(output)!r}: its place is taken")


def prepare(plan: BatchPlan) -> Site:
    """Check every name and parameter of a plan and derive its site; raises InputError."""
    scenario = plan.scenario
    check_agents(plan)
    for name in scenario.assertions:
        ASSERTIONS.make(name, scenario.assertion_params)
    kind_named(scenario.kind)
    ego = make_ego(scenario.ego, scenario.ego_params)
    return derive_site(scenario.net, scenario.ego_route, scenario.junction, ego.kind.length)


def _play(
    plan: BatchPlan, worker: Worker, writer: ResultsWriter, quiet: bool
) -> tuple[list[Row], int]:
    """Play the batch and write it; an interrupt keeps what ran."""
    rows: list[Row] = []
    learned: dict[str, Any] = {}
    status, word = Exit.OK, "finished"
    with Progress(plan.runs * len(plan.agents), quiet) as progress:
        try:
            for outcome, memory in run_batch(plan, worker):
                rows.append(writer.write(outcome))
                if memory is not None:
                    learned[outcome.row["agent"]] = memory
                progress.update(rows[-1])
        except KeyboardInterrupt:
            status, word = Exit.INTERRUPTED, "interrupted"
        finally:
            counts = Counter(row["outcome"] for row in rows)
            writer.finish(word, {"episodes": len(rows), "counts": counts, "learned": learned})
    return rows, status


def exit_status(rows: list[Row], exit_zero: bool) -> int:
    """0 all well, 1 the ego violated an assertion, 3 an episode could not be run."""
    if any(row["outcome"] == "error" for row in rows):
        return Exit.NOT_RUN
    return Exit.VIOLATED if any(map(is_failure, rows)) and not exit_zero else Exit.OK


def manifest(plan: BatchPlan, site: Site) -> dict[str, Any]:
    """What makes a batch reproducible."""
    scenario = plan.scenario
    files = [scenario.net, *([scenario.routes] if scenario.routes else []), *scenario.additional]
    packages = ("libsumo", "sumolib", "numpy", "shapely")
    return {
        "command": ["cavsumo", *sys.argv[1:]],
        "plan": plan.model_dump(mode="json"),
        "ego_route": list(site.route.edges),
        "junction": site.route.junction,
        "sha256": {str(f): hashlib.sha256(f.read_bytes()).hexdigest() for f in files},
        "versions": {"cavsumo": __version__, "python": platform.python_version()}
        | {name: importlib.metadata.version(name) for name in packages},
        "sumo_options": dict(OPTIONS),
    }


def _first_line(plan: BatchPlan, site: Site) -> str:
    """What was chosen, for the user to see."""
    scenario = plan.scenario
    ego = make_ego(scenario.ego, scenario.ego_params)
    attributes = " ".join(f"{k}={v}" for k, v in getattr(ego, "attributes", {}).items())
    driver = f"{scenario.ego} ({attributes})" if attributes else scenario.ego
    where = f" junction {site.route.junction}" if site.route.junction else ""
    routes = scenario.routes.name if scenario.routes else "none"
    return (
        f"cavsumo: agent {' '.join(plan.agents)}, {scenario.testers} {scenario.kind}s, "
        f"ego {driver}, network {scenario.name}{where}, traffic {routes}, "
        f"seed {plan.seed}, {plan.runs} episodes an agent"
    )


def replay(results: Path, run_number: int) -> int:
    """``cavsumo replay``: play a row again and compare it, frame by frame, bit for bit."""
    plan, recorded = recorded_plan(results)
    row = recorded_row(results, run_number)
    frames = recorded_frames(results, row)
    site = prepare(plan)
    _warn_of_changes(recorded, manifest(plan, site))
    again = replayed(plan, site, run_number)
    difference = first_difference(row, frames, again.row, again.frames)
    if difference is not None:
        print(f"run {run_number}: diverged: {difference}")
        return Exit.VIOLATED
    compared = f"{len(frames)} frames" if frames is not None else "its row (no trace was kept)"
    print(f"run {run_number} ({row['agent']}): {row['outcome']}, {compared}: the same")
    return Exit.OK


def replayed(plan: BatchPlan, site: Site, run_number: int) -> Outcome:
    """An episode once more; learners first live through the episodes before it."""
    memory, step = None, len(plan.agents)
    learns = any(a.recall() is not None for a in make_agents(plan, job(plan, run_number).agent))
    with Worker(plan, site) as worker:
        for earlier in range(run_number % step, run_number, step) if learns else ():
            _, memory = worker.play(job(plan, earlier, memory))
        outcome, _ = worker.play(dataclasses.replace(job(plan, run_number, memory), record=True))
    return outcome


def _warn_of_changes(recorded: Mapping[str, Any], now: Mapping[str, Any]) -> None:
    """Say on stderr what differs from the day of the recording."""
    for part in ("versions", "sha256", "sumo_options"):
        before = recorded.get(part)
        was = before if isinstance(before, dict) else {}
        for name, value in now[part].items():
            if was.get(name) != value:
                print(f"cavsumo: {part}: {name} was {was.get(name)}, is {value}", file=sys.stderr)
