"""Options of the command run: those of the settings, and how the batch is played and kept."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cavsumo.cli.options.values import values_of

if TYPE_CHECKING:
    from cavsumo.model.scenario.fields import Setting
    from cavsumo.model.study import Part

SCRATCH = "results.csv"  # where the results of a run without -o lie


def add_run(commands: Any) -> None:
    """The command run."""
    run = commands.add_parser(
        "run",
        help="run a batch of episodes and report the outcomes",
        description="Run a batch of episodes and report the outcomes. Every option has a "
        "default; a TOML file given with -c may hold the same keys, the command line wins.",
        allow_abbrev=False,
    )
    run.fill = _fill
    run.set_defaults(command=_run)


def _fill(run: argparse.ArgumentParser) -> None:
    """Add the options: of all settings, and of published scenarios."""
    fill(run)
    group = run.add_argument_group("published scenario")
    group.add_argument(
        "--scenario",
        metavar="FILE",
        help="OpenSCENARIO XML (.xosc): a scenario, or variations of one with a batch for each",
    )
    group.add_argument(
        "--scenario-param",
        action="append",
        metavar="NAME=VALUE",
        help="a value of a parameter of the scenario; repeat for several",
    )
    group.add_argument(
        "--scenario-root",
        metavar="FOLDER",
        help="folder that the files of the scenario may come from (default: its own)",
    )
    group.add_argument(
        "--scenario-ego",
        metavar="ENTITY",
        help="the entity under test (default Ego)",
    )


def fill(run: argparse.ArgumentParser) -> None:
    """Add the options of a batch, a group for each heading of the settings."""
    from cavsumo.cli.setting_options import add_setting
    from cavsumo.model.scenario.fields import settings

    offered = settings()
    for title in dict.fromkeys(setting.option.group for setting in offered):
        group = run.add_argument_group(title)
        for setting in (s for s in offered if s.option.group == title):
            several = _of_several(setting) if setting.key == "net" else {}
            add_setting(group.add_argument, setting, **several)
        if title in OTHERS:
            OTHERS[title](group.add_argument)


def _of_several(setting: Setting) -> dict[str, Any]:
    """Keywords of an option that is given once for each of several batches."""
    from cavsumo.cli.setting_options import help_of

    return {"action": "append", "help": f"{help_of(setting)}; repeat for a batch on each"}


def _add_config(add: Callable[..., Any]) -> None:
    add(
        "-c",
        "--config",
        metavar="FILE",
        help="scenario file (TOML); with a table [vary] of lists, a batch for each combination",
    )


def _add_means(add: Callable[..., Any]) -> None:
    add("-j", "--jobs", type=int, metavar="N", help="episodes at a time (default 1)")
    add("--executor", choices=("local", "dask"), default="local", help="default local")
    add("--scheduler", metavar="ADDRESS", help="address of dask's scheduler")


def _add_output(add: Callable[..., Any]) -> None:
    add("-o", "--output", metavar="FILE", help=f"default {SCRATCH}, which the next run replaces")
    add("--resume", action="store_true", help="go on where the results end, or start")
    add("--retry-errors", action="store_true", help="play the episodes again that ended in errors")
    add("--overwrite", action="store_true", help="start again in place of what is there")
    add("--exit-zero", action="store_true", help="exit with 0 although the ego failed")
    add("-q", "--quiet", action="store_true", help="no progress, no summary")


# Options that are no settings, by the heading under which they stand.
OTHERS: Mapping[str, Callable[[Callable[..., Any]], None]] = {
    "scenario": _add_config,
    "processes": _add_means,
    "output": _add_output,
}


def _run(options: argparse.Namespace) -> int:
    from cavsumo.cli.scenario_settings import parts_of, published

    found = published(options)
    if found is None:
        return played(parts_of(options), options)
    if not options.quiet:
        for note in found.notes:
            print(f"cavsumo: {options.scenario}: {note}", file=sys.stderr)
    return played(found.parts, options, found.places)


def played(
    parts: Sequence[Part],
    options: argparse.Namespace,
    places: Mapping[str, Path] | None = None,
) -> int:
    """Play the batches of a run as its options say.

    ``places``: the present paths of files that the parts name.
    """
    from cavsumo.batch.manner import Manner, Means
    from cavsumo.batch.planned import planned

    manner = Manner(**values_of(options, Manner), scratch=options.output is None)
    means = Means(options.jobs, options.executor, options.scheduler)
    batches = planned(parts, Path(options.output or SCRATCH), manner, places)
    # What can be refused quickly has been; now comes what takes long to import.
    from cavsumo.cli.commands.run import run_study

    return run_study(batches, means, manner)
