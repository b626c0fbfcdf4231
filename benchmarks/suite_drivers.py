"""Drivers through a published suite: the cases that each avoided, by the kind of target.

    python benchmarks/suite_drivers.py [--ego NAME[/REACTION_S] ...] [--only TEST ...] [-j 2]

The standard range of ``euroncap-2026`` for each driver. A driver that does not hold the speed of a
case until its target moves has not been tested there: ``not judged``.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import cavsumo

MODELS = ("sumo", "sumo:IDM", "sumo:EIDM", "sumo:ACC", "sumo:CACC")
EGOS = ("constant", "time-gap", *(f"{name}{s}" for name in MODELS for s in ("", "/0")))
TARGETS = {
    "pedestrians": ("CPNA", "CPFA", "CPNCO", "CPLA", "CPTA"),
    "bicyclists": ("CBNA", "CBNAO", "CBFA", "CBLA", "CBTA"),
    "cars": ("CCRs", "CCRm", "CCRb", "CCFtap", "CCFhos", "CCCscp"),
    "motorcyclists": ("CMRs", "CMRb", "CMFtap", "CMCscp"),
}
HEAD = f"{'ego':12}" + "".join(f"{name:>14}" for name in TARGETS) + "  mean km/h  not judged"


def line(ego: str, only: list[str], jobs: int) -> str:
    """One row of the table."""
    name, _, reaction = ego.partition("/")
    params: dict[str, Any] = {"reaction_s": float(reaction)} if reaction else {}
    how: dict[str, Any] = {"jobs": jobs, "progress": False, "trace": "none"}
    cases = cavsumo.suite("euroncap-2026", name, ego_params=params, only=only, **how).cases
    judged = cases[cases["avoided"].notna()]
    tests = judged["case"].str.split("/").str[0]
    counts = []
    for kinds in TARGETS.values():
        own = judged[tests.isin(kinds)]
        counts.append(f"{int(own['avoided'].sum())} of {len(own)}")
    impacts = judged.loc[judged["avoided"] == 0, "impact_kmh"]
    mean = f"{impacts.mean():.1f}" if len(impacts) else ""
    return (
        f"{ego:12}"
        + "".join(f"{count:>14}" for count in counts)
        + f"{mean:>11}{len(cases) - len(judged):>12}"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ego", action="append", default=[])
    parser.add_argument("--only", action="append", default=[])
    parser.add_argument("-j", "--jobs", type=int, default=2)
    options = parser.parse_args()
    began = time.perf_counter()
    print(HEAD)
    for ego in options.ego or EGOS:
        print(line(ego, options.only, options.jobs), flush=True)
    print(f"{time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main()
