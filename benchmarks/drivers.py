"""Drivers compared by their failures, over places and agents.

    python benchmarks/drivers.py NET... [--ego EGO ...] [--planner NAME=PYTHON ...]
        [--agent NAME ...] [--runs 20] [--traffic 6] [--learn 60] [--seed 1] [-j 1]

Each ego meets three pedestrians of each agent at each place in ``runs`` episodes, with the same
starts. Violations are judged by the reference driver ``human``. Egos of cavsumo by their names, by
default all that brake: SUMO's drivers decide once a second, those with ``/0`` in every timestep.
``--planner`` adds one of examples/planners (``fiss.fop``, ``fiss.fop_plus``, ``fiss.fiss``,
``fiss.fiss_plus``, ``frenet``, ``highway``, ``reactive``) with the Python that has its package.
``best-response`` learns against each ego as in ``places.py``.

``preventable``: failures that the reference driver avoids, of the tests, with a Wilson interval of
95 %. ``arrived``: of the episodes that no verdict ended. ``lost``: mean time lost against a free
drive. ``errors``: episodes that could not be played, such as for a planner that did not answer.
"""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path
from typing import Any

import pandas as pd
from places import LEARNER, learned

import cavsumo
from cavsumo.results.failures import PREVENTABLE, UNPREVENTABLE, failure_kind
from cavsumo.results.statistics import rate

PLANNERS = Path(__file__).parents[1] / "examples" / "planners"
EGOS: dict[str, dict[str, Any]] = {
    name: {"ego": name}
    for name in ("sumo:Krauss", "sumo:IDM", "sumo:EIDM", "sumo:ACC", "sumo:CACC", "time-gap")
}
EGOS |= {f"{ego}/0": {"ego": ego, "ego_params": {"reaction_s": 0}} for ego in list(EGOS)[:-1]}
SCRIPTS = {
    "fiss.fop": "fiss.py fop",
    "fiss.fop_plus": "fiss.py fop_plus",
    "fiss.fiss": "fiss.py fiss",
    "fiss.fiss_plus": "fiss.py fiss_plus",
    "frenet": "frenet.py",
    "highway": "highway.py",
    "reactive": "reactive.py",
}
PATIENCE = {"reply_s": 60.0, "start_s": 60.0}  # a planner may be slower than real time
HEAD = (
    f"{'ego':16} {'tests':>6} {'preventable [95 %]':>22} {'unpreventable':>13} {'unfair':>6} "
    f"{'arrived':>9} {'lost s':>6} {'errors':>6}"
)


def main() -> None:
    """Play and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("nets", type=Path, nargs="+")
    parser.add_argument("--ego", action="append", choices=EGOS)
    parser.add_argument(
        "--planner", action="append", default=[], type=planner, metavar="NAME=PYTHON"
    )
    parser.add_argument("--agent", action="append", choices=("timing", LEARNER))
    for name, default in (("runs", 20), ("traffic", 6), ("learn", 60), ("seed", 1)):
        parser.add_argument(f"--{name}", type=int, default=default)
    parser.add_argument("-j", "--jobs", type=int, default=1)
    options = parser.parse_args()
    chosen = options.ego or ([] if options.planner else list(EGOS))
    drivers = {name: EGOS[name] for name in chosen} | dict(options.planner)
    print(HEAD)
    for name, settings in drivers.items():
        print(line(name, played(settings, options)), flush=True)


def planner(word: str) -> tuple[str, dict[str, Any]]:
    """The name and the settings of one of examples/planners, ``NAME=PYTHON``."""
    name, _, python = word.partition("=")
    if name not in SCRIPTS or not python:
        known = ", ".join(SCRIPTS)
        raise argparse.ArgumentTypeError(f"expected NAME=PYTHON with NAME of {known}; got {word!r}")
    command = f"exec:{shlex.quote(python)} {shlex.quote(str(PLANNERS))}/{SCRIPTS[name]}"
    return name, {"ego": command, "ego_params": PATIENCE}


def played(settings: dict[str, Any], options: argparse.Namespace) -> pd.DataFrame:
    """The rows of an ego at all places against all agents."""
    found = []
    for net in options.nets:
        for agent in options.agent or ("timing", LEARNER):
            asked = settings | {"traffic": options.traffic, "agents": [agent], "progress": False}
            if agent == LEARNER:
                asked["params"] = learned(net, asked, options)
            kept = {"runs": options.runs, "seed": options.seed, "jobs": options.jobs}
            found.append(cavsumo.run(net, **asked, **kept, trace="none", deadline_s=3600.0).rows)
    return pd.concat(found, ignore_index=True)


def line(name: str, rows: pd.DataFrame) -> str:
    """One row of the table."""
    kinds = [failure_kind(row) for row in rows.to_dict("records")]
    tests = int(rows["outcome"].isin(["held", "violated"]).sum())
    found, ended = rate(kinds.count(PREVENTABLE), tests), rows["arrived"].dropna()
    share = "0"  # of no tests there is no interval
    if found.low is not None and found.high is not None:
        share = f"{found.count} [{100 * found.low:4.1f}, {100 * found.high:4.1f} %]"
    return (
        f"{name:16} {tests:6} {share:>22} {kinds.count(UNPREVENTABLE):13} "
        f"{(rows['outcome'] == 'unfair').sum():6} {int(ended.sum()):4}/{len(ended):<4} "
        f"{rows['lost_s'].mean():6.1f} {(rows['outcome'] == 'error').sum():6}"
    )


if __name__ == "__main__":
    main()
