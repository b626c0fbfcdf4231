"""Failures on places that nobody tuned to, preventable ones first.

    python benchmarks/places.py NET... [--agent NAME ...] [--ego EGO ...] [--runs 80] [--traffic 6]
        [--learn 180] [--seed 1] [-j 2]

Three pedestrians of each agent against each ego, ``runs`` episodes each, in traffic that is drawn
for the network; violations are judged by the reference driver ``human``. ``best-response`` first
learns over ``learn`` episodes against the ego of the column, on seeds of its own, and plays what it
learned without learning. Egos: ``sumo`` decides once a second, ``sumo/0`` in every timestep,
``time-gap`` is the controller of that name. ``arrived``: of the episodes that no verdict ended.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import cavsumo
from cavsumo.results.failures import NOT_JUDGED, PREVENTABLE, UNPREVENTABLE, failure_kind

AGENTS = ("random", "proximity", "timing", "best-response")
EGOS: dict[str, dict[str, Any]] = {
    "sumo": {"ego": "sumo"},
    "sumo/0": {"ego": "sumo", "ego_params": {"actionStepLength": 0}},
    "time-gap": {"ego": "time-gap"},
}
LEARNER = "best-response"
LEARNING_SEEDS = 1_000_000  # added to the seed of the batch that is counted
HEAD = (
    f"{'place':26} {'ego':9} {'agent':14} {'tests':>5} {'preventable':>11} {'unpreventable':>13} "
    f"{'not judged':>10} {'unfair':>6} {'arrived':>9} {'lost s':>6} {'simulated s':>11}"
)


def main() -> None:
    """Play and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("nets", type=Path, nargs="+")
    parser.add_argument("--agent", action="append", choices=AGENTS)
    parser.add_argument("--ego", action="append", choices=EGOS)
    for name, default in (("runs", 80), ("traffic", 6), ("learn", 180), ("seed", 1)):
        parser.add_argument(f"--{name}", type=int, default=default)
    parser.add_argument("-j", "--jobs", type=int, default=2)
    options = parser.parse_args()
    print(HEAD)
    for net in options.nets:
        for ego in options.ego or EGOS:
            for agent in options.agent or AGENTS:
                print(_line(net, ego, agent, options), flush=True)


def _line(net: Path, ego: str, agent: str, options: argparse.Namespace) -> str:
    """One row of the table."""
    settings = EGOS[ego] | {"traffic": options.traffic, "agents": [agent], "progress": False}
    if agent == LEARNER:
        settings["params"] = learned(net, settings, options)
    results = cavsumo.run(
        net, **settings, runs=options.runs, seed=options.seed, jobs=options.jobs, trace="none"
    )
    rows = results.rows
    kinds = [failure_kind(row) for row in rows.to_dict("records")]
    ended = rows[rows["arrived"].notna()]
    name = net.name.removesuffix(".net.xml")
    return (
        f"{name:26} {ego:9} {agent:14} {rows['outcome'].isin(['held', 'violated']).sum():5} "
        f"{kinds.count(PREVENTABLE):11} {kinds.count(UNPREVENTABLE):13} "
        f"{kinds.count(NOT_JUDGED):10} {(rows['outcome'] == 'unfair').sum():6} "
        f"{int(ended['arrived'].sum()):4}/{len(ended):<4} {rows['lost_s'].mean():6.1f} "
        f"{rows['time_s'].sum():11.0f}"
    )


def learned(net: Path, settings: dict[str, Any], options: argparse.Namespace) -> dict[str, Any]:
    """Parameters of a learner that plays what it learned against the same ego."""
    lessons = cavsumo.run(
        net, **settings, runs=options.learn, seed=options.seed + LEARNING_SEEDS, trace="none"
    )
    file = Path(tempfile.mkdtemp()) / "learned.json"
    file.write_text(json.dumps(lessons.manifest), encoding="utf-8")
    return {"learn": False, "model": str(file)}


if __name__ == "__main__":
    main()
