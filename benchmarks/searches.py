"""Searches beside testers that do not learn: preventable failures found a second, on places.

    python benchmarks/searches.py NET... [--ego EGO] [--tester search:portfolio --tester timing ...]
        [--runs 150] [--testers 1] [--seed 1 2 3] [--impact 2] [-j 1]

Every search has ``testers`` pedestrians, every other agent three as by default; no traffic,
reference ``human``. ``seeds``: those with a preventable failure of at least ``impact`` m/s.
``distinct``: kinds of preventable failures by impact speed, side and place.
Failures in 1000 simulated seconds have an interval of 95 % of Poisson's distribution; the failures
of one search depend on each other, so it is too narrow for a search.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import pandas as pd
from branching import processor_time
from scipy.stats import chi2

import cavsumo
from cavsumo.results.alike import FEATURES, kind_of
from cavsumo.results.failures import PREVENTABLE, failure_kind

HEAD = (
    f"{'place':26} {'tester':18} {'seeds':>7} {'preventable':>11} {'distinct':>8} {'others':>6} "
    f"{'unfair, invalid':>15} {'simulated s':>11} {'in 1000 s':>18} {'cpu s':>6}"
)


def main() -> None:
    """Play and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("nets", type=Path, nargs="+")
    parser.add_argument("--ego", default="sumo")
    parser.add_argument("--tester", action="append", default=[], help="an agent, or search:METHOD")
    parser.add_argument("--runs", type=int, default=150)
    parser.add_argument("--seed", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--testers", type=int, default=1, help="of a search")
    parser.add_argument("--impact", type=float, default=0.0)
    parser.add_argument("-j", "--jobs", type=int, default=1)
    options = parser.parse_args()
    searched = f"searches with {options.testers} testers"
    print(
        f"ego {options.ego}, {options.runs} episodes for each of {options.seed}, {searched}\n{HEAD}"
    )
    for net in options.nets:
        for tester in options.tester or ["search:portfolio", "timing"]:
            print(_line(net, tester, options), flush=True)


def _line(net: Path, tester: str, options: argparse.Namespace) -> str:
    """One row of the table: the batches of all seeds."""
    before = processor_time()
    batches = [played(net, tester, seed, options) for seed in options.seed]
    cpu, rows = processor_time() - before, pd.concat(batches)
    failures = [preventable_among(batch) for batch in batches]
    hard = sum((found["impact_speed_mps"] >= options.impact).any() for found in failures)
    count, seconds = sum(map(len, failures)), float(rows["time_s"].sum())
    others = int((rows["outcome"] == "violated").sum()) - count
    spoilt = rows["outcome"].isin(["unfair", "invalid"]).mean()
    rate = per_1000_s(count, seconds)
    name = net.name.removesuffix(".net.xml")
    return (
        f"{name:26} {tester:18} {f'{hard}/{len(batches)}':>7} {count:11} "
        f"{sum(map(_kinds, failures)):8} {others:6} {spoilt:15.1%} {seconds:11.0f} {rate:>18} "
        f"{cpu:6.0f}"
    )


def played(
    net: Path, tester: str, seed: int, options: argparse.Namespace, **settings: Any
) -> pd.DataFrame:
    """The rows of one batch; ``settings`` of its scenario go before the others."""
    agent, _, method = tester.partition(":")
    how: dict[str, Any] = {"agents": [agent]}
    if method:
        how |= {"testers": options.testers, "params": {"search.method": method}}
    how |= settings
    return cavsumo.run(
        net, routes="none", ego=options.ego, runs=options.runs, seed=seed, trace="none",
        jobs=options.jobs, progress=False, **how,
    ).rows  # fmt: skip


def preventable_among(rows: pd.DataFrame) -> pd.DataFrame:
    """The preventable failures among rows."""
    return rows[[failure_kind(row) == PREVENTABLE for row in rows.to_dict("records")]]


def _kinds(failures: pd.DataFrame) -> int:
    """How many of them are not alike."""
    return len({kind_of(row) for row in failures[list(FEATURES)].astype(str).to_dict("records")})


def per_1000_s(count: int, seconds: float) -> str:
    """A count in 1000 seconds, with its interval."""
    low, high = (1000.0 * bound / seconds for bound in _poisson(count))
    return f"{1000.0 * count / seconds:.1f} [{low:.1f}, {high:.1f}]"


def _poisson(count: int) -> tuple[float, float]:
    """An exact interval of 95 % for the mean of a Poisson variable."""
    low = float(chi2.ppf(0.025, 2 * count)) / 2.0 if count else 0.0
    return low, float(chi2.ppf(0.975, 2 * count + 2)) / 2.0


if __name__ == "__main__":
    main()
