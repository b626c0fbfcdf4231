"""The time that is saved by ending episodes in which nobody can meet the ego any more.

    python benchmarks/early_end.py --net crossing --net junction --runs 200

Plays the same points of a search, or with ``--agent exposure`` the same encounters of an estimate,
to their ends and cut, and compares what is learned of them.
"""

from __future__ import annotations

import argparse
from typing import Any

from branching import processor_time

import cavsumo

LEARNED = (
    "outcome", "verdicts", "tester", "trigger_time_s", "violation_time_s", "impact_speed_mps",
    "avoidable", "avoidable_ideal", "last_chance_s", "breach", "grade",
)  # fmt: skip
METHODS = {"search": "manoeuvres", "exposure": "monte-carlo"}  # they learn nothing


def played(net: str, cut: bool, options: argparse.Namespace) -> tuple[Any, float]:
    """The rows of a search, and the processor time [s]."""
    params = {"method": options.method or METHODS[options.agent], "cut": cut}
    before = processor_time()
    results = cavsumo.run(
        net,
        routes=options.routes,
        ego=options.ego,
        kind=options.kind,
        agents=[options.agent],
        params={f"{options.agent}.{key}": value for key, value in params.items()},
        testers=options.testers,
        runs=options.runs,
        seed=options.seed,
        trace="none",
        jobs=1,
        progress=False,
    )
    return results.rows, processor_time() - before


def line(net: str, options: argparse.Namespace) -> str:
    """A line of the table."""
    whole, whole_cpu = played(net, False, options)
    cut, cut_cpu = played(net, True, options)
    before, after = whole["time_s"].sum(), cut["time_s"].sum()
    one, other = whole[list(LEARNED)], cut[list(LEARNED)]
    same = ((one == other) | (one.isna() & other.isna())).all(axis=1)
    return (
        f"{net.split('/')[-1].removesuffix('.net.xml'):26}{options.ego:12}{len(cut):6}"
        f"{(cut['time_s'] < whole['time_s']).sum():6}{(~same).sum():8}{before:8.0f}{after:8.0f}"
        f"{after / before:7.2f}{whole_cpu:8.1f}{cut_cpu:8.1f}{cut_cpu / whole_cpu:7.2f}"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--net", action="append", required=True)
    parser.add_argument("--ego", default="sumo")
    parser.add_argument("--routes", default="none")
    parser.add_argument("--agent", default="search", choices=METHODS)
    parser.add_argument("--kind", default="pedestrian")
    parser.add_argument("--method", help="one that learns nothing")
    parser.add_argument("--testers", type=int, default=1)
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    print(
        f"{'net':26}{'ego':12}{'runs':>6}{'cut':>6}{'differ':>8}{'s':>8}{'cut s':>8}{'ratio':>7}"
        f"{'cpu s':>8}{'cut':>8}{'ratio':>7}"
    )
    for net in options.net:
        print(line(net, options), flush=True)


if __name__ == "__main__":
    main()
