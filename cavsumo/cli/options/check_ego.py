"""Options of the command check-ego; the heavy parts are imported when it is called."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cavsumo.model.scenario.fields import Setting


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
    check.fill = _fill
    check.set_defaults(command=_check_ego)


def _fill(check: argparse.ArgumentParser) -> None:
    """Add the options; some are settings of a scenario."""
    from cavsumo.cli.setting_options import add_setting, meaning

    add = check.add_argument
    add("ego", metavar="SPEC", help="as for run --ego: a name, module:Class, exec:..., tcp:...")
    for setting in _settings():
        must = {"required": True, "help": meaning(setting)} if setting.key == "net" else {}
        add_setting(add, setting, **must)
    add("--deadline", type=float, default=60.0, metavar="S", help="of each check [s] (default 60)")


def _settings() -> list[Setting]:
    """The settings of a scenario that matter to an ego alone."""
    from cavsumo.model.scenario.fields import settings

    return [s for s in settings() if s.key in ("net", "ego_params", "step_length")]


def _check_ego(options: argparse.Namespace) -> int:
    from cavsumo.batch.planned import check_plan
    from cavsumo.cli.setting_options import given
    from cavsumo.model.scenario import plan_from

    settings = {"ego": options.ego, **given(options, _settings())}
    check_plan(plan_from(settings, "check-ego"))
    from cavsumo.cli.commands.check_ego import check_ego

    return check_ego(settings, options.deadline)
