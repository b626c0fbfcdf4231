"""Options of the command run; its heavy parts are imported when it is called."""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path
from typing import Any

from cavsumo.cli.options.networks import net_help
from cavsumo.cli.scenario_settings import parts_of
from cavsumo.model.named_networks import DEFAULT


def add_run(commands: Any) -> None:
    """The command run."""
    run = commands.add_parser(
        "run",
        help="run a batch of episodes and report the outcomes",
        description="Run a batch of episodes and report the outcomes. Every option has a "
        "default; a TOML file given with -c may hold the same keys, the command line wins.",
        allow_abbrev=False,
    )
    _add_scenario(run.add_argument_group("scenario"))
    _add_testers(run.add_argument_group("testers"))
    batch = run.add_argument_group("batch")
    batch.add_argument("--runs", type=int, metavar="N", help="episodes an agent (default 100)")
    batch.add_argument("--seed", type=int, help="seed of the batch (default 1)")
    batch.add_argument("-e", "--end", type=float, metavar="S", help="horizon [s] (default 60)")
    batch.add_argument("--step-length", type=float, metavar="S", help="timestep [s] (default 0.1)")
    batch.add_argument(
        "--deadline", type=float, metavar="S", help="real time an episode may take (default 120)"
    )
    batch.add_argument(
        "--reset",
        choices=("fresh", "shared"),
        help="shared: search in one simulation for many episodes, then play each test found again "
        "in a fresh one (default fresh)",
    )
    _add_means(run.add_argument_group("processes"))
    _add_stopping(run.add_argument_group("stopping early"))
    output = run.add_argument_group("output")
    output.add_argument(
        "-o", "--output", default="results.csv", metavar="FILE", help="default results.csv"
    )
    output.add_argument(
        "--trace", choices=("none", "tests", "all"), help="frames to keep (default tests)"
    )
    output.add_argument(
        "--resume", action="store_true", help="go on where the results end, or start"
    )
    output.add_argument(
        "--retry-errors", action="store_true", help="play the episodes again that ended in errors"
    )
    output.add_argument(
        "--overwrite", action="store_true", help="start again in place of an unfinished batch"
    )
    output.add_argument(
        "--exit-zero",
        action="store_true",
        help="exit with 0 whatever the ego did",
    )
    output.add_argument("-q", "--quiet", action="store_true", help="no progress, no summary")
    run.set_defaults(command=_run)


def _add_means(group: Any) -> None:
    add = group.add_argument
    add("-j", "--jobs", type=int, metavar="N", help="episodes at a time (default 1)")
    add("--executor", choices=("local", "dask"), default="local", help="default local")
    add("--scheduler", metavar="ADDRESS", help="address of dask's scheduler")
    add("--shard", metavar="I/N", help="play part I of N; cavsumo merge puts them together")


def _add_stopping(group: Any) -> None:
    add = group.add_argument
    switch = argparse.BooleanOptionalAction
    first = "stop at the first failure (with a reference driver: the first preventable one)"
    add("-x", "--first", action=switch, default=None, help=first)
    add("--until-tests", type=int, metavar="N", help="stop after N tests")
    add(
        "--until-half-width",
        metavar="H",
        help="stop when every agent's rate is known to H, such as 0.02, or 10%% of the rate",
    )
    rates = ("tests", "preventable", "failures")
    add("--until-rate", choices=rates, help="the rate meant (default tests)")
    add("--budget", type=float, metavar="S", help="stop after S seconds of real time")


def _add_scenario(group: Any) -> None:
    add = group.add_argument
    add("-n", "--net", "--net-file", metavar="NET", help=f"{net_help()} (default {DEFAULT})")
    add(
        "-r",
        "--routes",
        "--route-files",
        metavar="FILE",
        help="background demand, or none (default: routes/NAME.rou.xml when it exists and no "
        "--traffic is given)",
    )
    add(
        "--traffic",
        metavar="DENSITY",
        help="draw background traffic instead: departures per minute and kilometre, of cars (on "
        "roads, each direction counted) and of pedestrians (on pavements); 4 for both, 4,2 for "
        "each, none; not with --routes FILE",
    )
    add("-a", "--additional-files", metavar="FILES", help="SUMO additional files, with commas")
    add(
        "-c",
        "--config",
        metavar="FILE",
        help="scenario file (TOML); with a table [vary] of lists, a batch for each combination",
    )
    add(
        "--ego",
        metavar="NAME",
        help="an ego by name, module:Class, exec:COMMAND, tcp:HOST:PORT; see cavsumo egos",
    )
    add("--ego-param", action="append", metavar="KEY=VALUE", help="a parameter of the ego")
    add(
        "--ego-sensor",
        action="append",
        metavar="KEY=VALUE",
        help="what the ego sees of others: range_m, position_noise_m, heading_noise_rad, "
        "speed_noise_mps, delay_s, occlusion=true (default: everybody, exactly, at once)",
    )
    add(
        "--ego-route",
        metavar="ROUTE",
        help="edges of the ego's route, with commas or spaces; or straight, left, right, u-turn: "
        "the best such way through the junction under test",
    )
    add("--junction", metavar="ID", help="junction under test (default: the best one)")
    add(
        "--signal",
        metavar="COLOUR",
        help="what the ego meets at the first traffic light on its route when nothing hinders it: "
        "green, red, or any (default any)",
    )
    add(
        "--assert",
        dest="assertions",
        action="append",
        metavar="NAME",
        help="what the ego must keep: an assertion by name, module:function or a formula's name; "
        "repeat for several",
    )
    add("--assert-param", action="append", metavar="KEY=VALUE", help="a parameter of theirs")
    add(
        "--formula",
        action="append",
        metavar="NAME=TEXT",
        help="temporal logic that the ego must keep too, such as 'apart=always (gap_m > 0.5)'",
    )
    add(
        "--reference",
        choices=("none", "ideal", "human", "rss"),
        help="the driver who takes over to see whether a violation was avoidable (default human: "
        "careful and competent, UN R157); none to leave it out",
    )


def _add_testers(group: Any) -> None:
    add = group.add_argument
    add(
        "--agent",
        dest="agents",
        action="append",
        metavar="NAME",
        help="repeat to compare; LABEL=NAME for one with parameters of its own",
    )
    add("--testers", type=int, metavar="N", help="number of tester bodies (default 3)")
    add(
        "--param",
        action="append",
        metavar="KEY=VALUE",
        help="parameter of the agents that have it; NAME.KEY=VALUE or LABEL.KEY=VALUE for one",
    )
    add(
        "--tester-sensor",
        action="append",
        metavar="KEY=VALUE",
        help="what the agents see of others, as --ego-sensor",
    )
    add("--kind", help="kind of body: pedestrian (default), car, bus or bicycle")
    add(
        "--jaywalk",
        action=argparse.BooleanOptionalAction,
        default=None,
        help="start anywhere beside the road, also where there is no pavement",
    )
    add(
        "--approach",
        dest="approaches",
        action="append",
        metavar="TYPE",
        help="of vehicles: crossing, merging, following or adjacent; repeat for several",
    )
    add("--bodies-per-agent", type=int, metavar="N", help="default 1")
    add("--embodiment", choices=("vehicle", "person"), help="what SUMO is shown")
    add("--sumo-width", type=float, metavar="M", help="width SUMO is shown (default 0.05)")
    add("--start-speed", type=float, metavar="V", help="speed at the start (default: maximum)")


def _run(options: argparse.Namespace) -> int:
    from cavsumo.batch.executors import Means
    from cavsumo.batch.preflight import Manner
    from cavsumo.cli.commands.run import run_study

    manner = Manner(**{f.name: getattr(options, f.name) for f in dataclasses.fields(Manner)})
    means = Means(options.jobs, options.executor, options.scheduler)
    return run_study(parts_of(options), Path(options.output), means, manner)
