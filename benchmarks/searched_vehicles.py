"""Searches with vehicles and bicycles beside testers that do not learn, on places.

    PYTHONPATH=experiments/search python benchmarks/searched_vehicles.py NET... [--kind car
        --kind bicycle] [--ego EGO] [--tester search:portfolio --tester timing ...] [--runs 100]
        [--seed 1 2 3] [--testers 1] [-j 1]

For each place, kind of tester and tester: in how many of the seeds it failed the ego preventably,
how often in a hundred episodes (with Wilson's interval) and in 1000 simulated seconds (with
Poisson's), both of 95 %, and how many of its episodes are unfair or invalid. The failures of one
search depend on each other, so its intervals are too narrow. ``search:random`` is uniform over the
space of the search, ``random`` the agent. No traffic, reference ``human``. Faulty drivers of
``experiments/search`` can be egos, such as ``faulty_drivers:ReactsLate``.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import pandas as pd
from searches import per_1000_s, played, preventable_among

from cavsumo.results.statistics import rate

TESTERS = ("search:portfolio", "search:random", "timing", "random")
HEAD = (
    f"{'place':26} {'kind':8} {'tester':17} {'seeds':>5} {'preventable':>11} "
    f"{'in 100 episodes':>18} {'in 1000 s':>18} {'others':>6} {'tests':>5} {'unfair, invalid':>15} "
    f"{'simulated s':>11}"
)


def line(net: Path, kind: str, tester: str, options: argparse.Namespace) -> str:
    """One row of the table: the batches of all seeds."""
    batches = [
        played(net, tester, seed, options, kind=kind, testers=options.testers)
        for seed in options.seed
    ]
    found, rows = [len(preventable_among(batch)) for batch in batches], pd.concat(batches)
    count, outcome = sum(found), rows["outcome"]
    said = rate(count, len(rows))
    share = f"{count / len(rows):.1%} [{said.low:.1%}, {said.high:.1%}]"
    spoilt = outcome.isin(["unfair", "invalid"]).mean()
    seconds = float(rows["time_s"].sum())
    return (
        f"{net.name.removesuffix('.net.xml'):26} {kind:8} {tester:17} "
        f"{f'{sum(map(bool, found))}/{len(batches)}':>5} {count:11} {share:>18} "
        f"{per_1000_s(count, seconds):>18} {int((outcome == 'violated').sum()) - count:6} "
        f"{int(outcome.isin(['held', 'violated']).sum()):5} {spoilt:15.1%} {seconds:11.0f}"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("nets", type=Path, nargs="+")
    parser.add_argument("--kind", action="append", default=[])
    parser.add_argument("--ego", default="sumo")
    parser.add_argument("--tester", action="append", default=[], help="an agent, or search:METHOD")
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--seed", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--testers", type=int, default=1)
    parser.add_argument("-j", "--jobs", type=int, default=1)
    options = parser.parse_args()
    print(f"ego {options.ego}, {options.runs} episodes for each of {options.seed}\n{HEAD}")
    for net in options.nets:
        for kind in options.kind or ["car", "bicycle"]:
            for tester in options.tester or TESTERS:
                print(line(net, kind, tester, options), flush=True)


if __name__ == "__main__":
    main()
