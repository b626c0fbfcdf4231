"""Options of the command estimate: those of run, the exposure, and when it is enough."""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cavsumo.agents.names import ESTIMATE_METHODS, EXPOSURE
from cavsumo.cli.options.run import SCRATCH, fill
from cavsumo.cli.options.values import values_of
from cavsumo.cli.requests.estimate import EstimateShown
from cavsumo.errors import InputError

if TYPE_CHECKING:
    from cavsumo.model.study import Part

DEFAULTS = {"agents": [EXPOSURE], "testers": 1, "runs": 2000}
PLAIN = "monte-carlo"
ALL = 1e-6  # a half-width that no episodes reach
# Where episodes without -o lie: the first that the output itself does not go into. A result as JSON
# may go by a pipe into a file that is not seen from here, mostly results.json.
PLACES = {False: (SCRATCH, "estimate.csv", "episodes.csv"), True: ("episodes.csv", "estimate.csv")}
PICTURES = (".svg", ".png")


def add_estimate(commands: Any) -> None:
    """The command estimate."""
    estimate = commands.add_parser(
        "estimate",
        help="estimate how often an ego fails preventably",
        description="Estimate how often an ego fails preventably when pedestrians, cyclists or "
        "drivers (--kind) do what an exposure says. All options of run, with other defaults: agent "
        f"{EXPOSURE}, one tester.",
        allow_abbrev=False,
    )
    estimate.fill = _fill
    estimate.set_defaults(command=_estimate)


def _fill(estimate: argparse.ArgumentParser) -> None:
    """Add the options."""
    add = estimate.add_argument
    add("--exposure", metavar="FILE", help="what people do by chance (TOML)")
    add(
        "--method", choices=ESTIMATE_METHODS, metavar="NAME",
        help=f"estimator: {', '.join(ESTIMATE_METHODS)} (default {ESTIMATE_METHODS[0]})",
    )  # fmt: skip
    add(
        "--half-width", type=float, metavar="H",
        help="end when half of the interval is at most H of the estimate (default 0.3)",
    )  # fmt: skip
    add("--bound", type=float, metavar="P", help="end when the interval's upper end is at most P")
    add("--max-episodes", type=int, metavar="N", help="the most to play (default 2000)")
    add("--against", metavar="EGO", help="another ego that meets the same encounters: their ratio")
    add("--json", action="store_true", dest="as_json", help="print one JSON object")
    add("--picture", metavar="FILE", help="draw how it developed (.svg or .png)")
    fill(estimate)


def _estimate(options: argparse.Namespace) -> int:
    from cavsumo.batch.manner import Manner, Means
    from cavsumo.batch.planned import planned
    from cavsumo.cli.options.redirected import free_output
    from cavsumo.cli.scenario_settings import parts_of

    shown = _shown(options)
    parts = [_estimating(part, options) for part in parts_of(options)]
    if options.against:
        parts = _against(parts, options)
    manner = Manner(**values_of(options, Manner), scratch=options.output is None)
    means = Means(options.jobs, options.executor, options.scheduler)
    output = free_output(options.output, PLACES[options.as_json], parts)
    batches = planned(parts, output, manner)
    from cavsumo.cli.commands.estimate import estimate

    return estimate(batches, means, manner, shown)


def _shown(options: argparse.Namespace) -> EstimateShown:
    """How the result is shown; raises InputError for numbers and names that cannot be."""
    if options.bound is not None and not 0.0 < options.bound < 1.0:
        raise InputError(f"--bound: expected a probability between 0 and 1, got {options.bound:g}")
    if options.half_width is not None and not options.half_width > 0.0:
        raise InputError(f"--half-width: expected a number above 0, got {options.half_width:g}")
    picture = Path(options.picture) if options.picture else None
    if picture and picture.suffix not in PICTURES:
        raise InputError(f"--picture {str(picture)!r}: expected a name that ends in .svg or .png")
    return EstimateShown(options.as_json, picture, options.bound)


def _estimating(part: Part, options: argparse.Namespace) -> Part:
    """A part that estimates."""
    if "agents" in part.settings:
        raise InputError("estimate: --agent: expected none, it has an agent of its own")
    keys = ("method", "exposure", "half_width", "bound")
    given = {key: getattr(options, key) for key in keys if getattr(options, key) is not None}
    settings = dict(part.settings)
    if given:
        chosen = {f"{EXPOSURE}.{key}": value for key, value in given.items()}
        settings["params"] = {**(settings.get("params") or {}), **chosen}
    if options.max_episodes is not None:
        settings["runs"] = options.max_episodes
    return dataclasses.replace(part, settings=settings, defaults={**part.defaults, **DEFAULTS})


def _against(parts: list[Part], options: argparse.Namespace) -> list[Part]:
    """A batch for each of two egos, all episodes of both by chance."""
    if len(parts) > 1 or parts[0].name:
        raise InputError("--against: compares two egos in one scenario")
    if options.method not in (None, "auto", PLAIN):
        raise InputError(f"--against: needs --method {PLAIN}, as both meet the same encounters")
    settings = parts[0].settings
    params = {**(settings.get("params") or {}), f"{EXPOSURE}.method": PLAIN}
    params[f"{EXPOSURE}.half_width"] = ALL
    first = {**settings, "params": params}
    second = {**first, "ego": options.against, "ego_params": {}}
    return [
        dataclasses.replace(parts[0], name=name, settings=chosen)
        for name, chosen in (("first", first), ("second", second))
    ]
