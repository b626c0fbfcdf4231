"""Vehicles and bicycles as searched testers against blindly timed ones, on the same episodes.

    PYTHONPATH=experiments/search python benchmarks/searched_vehicles.py --kind car --kind bicycle

For each place, kind of tester and ego: how many preventable failures the agents ``search`` and
``timing`` find in as many episodes, and when the first; without traffic.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import NamedTuple

import cavsumo

EGOS = ("sumo", "time-gap", "faulty_drivers:Careful", "faulty_drivers:ReactsLate",
        "faulty_drivers:WeakBrakes", "faulty_drivers:LooksRarely",
        "faulty_drivers:ForgivesOnce")  # fmt: skip
AGENTS = ("search", "timing")


class Found(NamedTuple):
    """The findings of one agent.

    Attributes:
        preventable, others: failures that the reference driver would have prevented, and not.
        first: the episode of the first preventable one, from 1; None for none.
        spoilt: unfair and invalid episodes.
        seconds: simulated time of all episodes [s].
    """

    preventable: int
    others: int
    first: int | None
    spoilt: int
    seconds: float


def found(net: str, kind: str, ego: str, agent: str, options: argparse.Namespace) -> Found:
    """Play one batch."""
    rows = cavsumo.run(
        net, routes="none", kind=kind, ego=ego, agents=[agent], testers=options.testers,
        runs=options.runs, seed=options.seed, trace="none", jobs=options.jobs, progress=False,
    ).rows  # fmt: skip
    failed = rows["outcome"] == "violated"
    preventable = (failed & (rows["avoidable"] == 1)).to_numpy()
    return Found(
        int(preventable.sum()),
        int(failed.sum() - preventable.sum()),
        int(preventable.argmax()) + 1 if preventable.any() else None,
        int(rows["outcome"].isin(["unfair", "invalid"]).sum()),
        float(rows["time_s"].sum()),
    )


def lines(options: argparse.Namespace) -> Iterator[str]:
    """The table, a line for each place, kind and ego."""
    yield (
        "| place | kind | ego | agent | preventable | first after | others | unfair or invalid | "
        "simulated s |"
    )
    yield "| --- | --- | --- | --- | ---: | ---: | ---: | ---: | ---: |"
    for net in options.net or ["crossing"]:
        for kind in options.kind or ["car"]:
            for ego in options.ego or EGOS:
                for agent in AGENTS:
                    one = found(net, kind, ego, agent, options)
                    yield (
                        f"| {net} | {kind} | {ego.rpartition(':')[2]} | {agent} | "
                        f"{one.preventable} | {one.first or ''} | {one.others} | {one.spoilt} | "
                        f"{one.seconds:.0f} |"
                    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("net", "kind", "ego"):
        parser.add_argument(f"--{name}", action="append", default=[])
    parser.add_argument("--testers", type=int, default=1)
    parser.add_argument("--runs", type=int, default=150)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-j", "--jobs", type=int, default=1)
    for line in lines(parser.parse_args()):
        print(line, flush=True)


if __name__ == "__main__":
    main()
