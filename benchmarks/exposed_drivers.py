"""How often drivers fail preventably among pedestrians who do what people do by chance.

    PYTHONPATH=experiments/search python benchmarks/exposed_drivers.py --max-episodes 1000

One estimate for each driver by ``cavsumo estimate`` under one exposure, on one network without
traffic: the careful driver of ``experiments/search``, its faulty variants, and others that are
named. A driver whose fault needs two pedestrians meets two. An estimate ends early where half of
its interval is at most 0.3 of it, so frequent failures cost few episodes.
"""

from __future__ import annotations

import argparse
import importlib
from collections.abc import Iterator

import cavsumo

MODULE = "faulty_drivers"


def drivers() -> dict[str, int]:
    """The drivers of experiments/search, and how many pedestrians each meets."""
    there = importlib.import_module(MODULE)
    return {f"{MODULE}:{name}": n for name, n in {there.CAREFUL: 1, **there.TESTERS}.items()}


def lines(options: argparse.Namespace) -> Iterator[str]:
    """The table, a line for each driver."""
    yield "| driver | pedestrians | episodes | failures | an encounter [95 %] | simulated s |"
    yield "| --- | ---: | ---: | ---: | --- | ---: |"
    known = drivers()
    for ego in options.ego or known:
        testers = known.get(ego, 1)
        found = cavsumo.estimate(
            options.net,
            ego=ego,
            routes="none",
            exposure=options.exposure,
            method=options.method,
            max_episodes=options.max_episodes,
            testers=testers,
            seed=options.seed,
            jobs=options.jobs,
            trace="none",
            progress=False,
        )
        facts = found.facts
        result = found.refused or f"{found.p:.2g} [{found.lower:.2g}, {found.upper:.2g}]"
        yield (
            f"| {ego.removeprefix(f'{MODULE}:')} | {testers} | {found.episodes} | "
            f"{facts['failures']} | {result} | {facts['simulated_s']:.0f} |"
        )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--net", default="crossing")
    parser.add_argument("--ego", action="append", help="by default those of experiments/search")
    parser.add_argument("--exposure", help="a TOML file; without it the default")
    parser.add_argument("--method", default="monte-carlo")
    parser.add_argument("--max-episodes", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-j", "--jobs", type=int, default=1)
    for line in lines(parser.parse_args()):
        print(line, flush=True)


if __name__ == "__main__":
    main()
