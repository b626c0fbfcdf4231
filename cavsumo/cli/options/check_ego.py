"""Options of the command check-ego; the heavy parts are imported when it is called."""

from __future__ import annotations

import argparse
from typing import Any

from cavsumo.cli.scenario_settings import assignment


def add_check_ego(commands: Any) -> None:
    """The command check-ego."""
    check = commands.add_parser(
        "check-ego",
        help="try an ego against what every ego must do",
        description="Play scripted drives to an ego (start, empty and crowded road, the same "
        "episode again, ten minutes, odd numbers, two at once), then two episodes in SUMO; say "
        "what passes and what does not.",
        allow_abbrev=False,
    )
    add = check.add_argument
    add("ego", metavar="SPEC", help="as for run --ego: a name, module:Class, exec:..., tcp:...")
    add("-n", "--net", required=True, metavar="NET", help="where it drives, as for run")
    add("--ego-param", action="append", default=[], metavar="KEY=VALUE", help="repeat for several")
    add("--step-length", type=float, default=0.1, metavar="S", help="timestep [s] (default 0.1)")
    add("--deadline", type=float, default=60.0, metavar="S", help="of each check [s] (default 60)")
    check.set_defaults(command=_check_ego)


def _check_ego(options: argparse.Namespace) -> int:
    from cavsumo.cli.commands.check_ego import check_ego

    settings = {
        "net": options.net,
        "ego": options.ego,
        "ego_params": dict(assignment("--ego-param", word) for word in options.ego_param),
        "step_length": options.step_length,
    }
    return check_ego(settings, options.deadline)
