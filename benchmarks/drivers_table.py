"""One table of drivers: published suites, and failures on places.

    python benchmarks/drivers_table.py NET... [--ego EGO ...] [--planner NAME=PYTHON ...]
        [--ncap 6] [--r157 600] [--runs 3] [--traffic 6] [--seed 1] [-j 1]

Two tables in Markdown. The first has a line for each driver: of the standard range of
``euroncap-2026``, every ``ncap``-th case, those that it avoided; of ``un-r157``, every
``r157``-th case, the impacts among those that the regulation's careful driver avoids; and ``runs``
episodes at each place, with three pedestrians of ``timing``: preventable failures of the tests
(reference ``human``), arrivals of the episodes that no verdict ended, and the mean time lost.
Wilson intervals of 95 %; 0 leaves a part out. The second has for each test of ``euroncap-2026``
avoided of judged cases, and the mean impact speed. Egos and planners as in ``drivers.py``; all meet
the same.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import pandas as pd
from drivers import EGOS, planner

import cavsumo
from cavsumo.results.failures import PREVENTABLE, failure_kind
from cavsumo.results.statistics import rate

DRIVERS: dict[str, dict[str, Any]] = {"constant": {"ego": "constant"}} | EGOS
HEAD = (
    "| ego | euroncap-2026: avoided | impact [km/h] | un-r157: preventable impacts | places: "
    "preventable failures | arrived | lost [s] | not tested |\n" + "| --- " * 8 + "|"
)


def main() -> None:
    """Play and print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("nets", type=Path, nargs="*")
    parser.add_argument("--ego", action="append", choices=DRIVERS)
    parser.add_argument(
        "--planner", action="append", default=[], type=planner, metavar="NAME=PYTHON"
    )
    defaults = (("ncap", 6), ("r157", 600), ("runs", 3), ("traffic", 6), ("seed", 1))
    for name, default in defaults:
        parser.add_argument(f"--{name}", type=int, default=default)
    parser.add_argument("-j", "--jobs", type=int, default=1)
    options = parser.parse_args()
    chosen = options.ego or ([] if options.planner else list(DRIVERS))
    drivers = {name: DRIVERS[name] for name in chosen} | dict(options.planner)
    by_test = {}
    print(HEAD)
    for name, settings in drivers.items():
        cases = suite_cases("euroncap-2026", options.ncap, settings, options)
        by_test[name] = cases
        regulation = suite_cases("un-r157", options.r157, settings, options)
        print(line(name, cases, regulation, placed(settings, options)), flush=True)
    print("\n" + table_by_test(by_test))


def suite_cases(
    suite: str, every: int, settings: dict[str, Any], options: argparse.Namespace
) -> pd.DataFrame:
    """The cases of a suite with a driver, every so many-th of them; of 0 none."""
    if not every:
        return pd.DataFrame(columns=["test", "avoided", "impact_kmh", "preventable"])
    how = {"jobs": options.jobs, "progress": False, "trace": "none", "deadline_s": 3600.0}
    played = cavsumo.suite(suite, **settings, shard=f"1/{every}", seed=options.seed, **how)
    return played.cases


def placed(settings: dict[str, Any], options: argparse.Namespace) -> pd.DataFrame:
    """The rows of a driver at all places."""
    how = {"runs": options.runs, "seed": options.seed, "jobs": options.jobs, "trace": "none"}
    how |= {"traffic": options.traffic, "agents": ["timing"], "progress": False}
    rows = [cavsumo.run(net, **settings, **how, deadline_s=3600.0).rows for net in options.nets]
    return pd.concat(rows, ignore_index=True) if rows else pd.DataFrame()


def line(name: str, cases: pd.DataFrame, regulation: pd.DataFrame, places: pd.DataFrame) -> str:
    """One row of the first table."""
    judged, ruled = (found[found["avoided"].notna()] for found in (cases, regulation))
    careful = ruled[ruled["preventable"] == 1]
    impacts = judged.loc[judged["avoided"] == 0, "impact_kmh"]
    not_tested = len(cases) - len(judged) + len(regulation) - len(ruled)
    cells = [
        name,
        told(int(judged["avoided"].sum()), len(judged)),
        f"{impacts.mean():.1f}" if len(impacts) else "",
        told(int((careful["avoided"] == 0).sum()), len(careful)),
        *cells_of_places(places),
        str(not_tested + (int((places["outcome"] == "error").sum()) if len(places) else 0)),
    ]
    return f"| {' | '.join(cells)} |"


def cells_of_places(rows: pd.DataFrame) -> list[str]:
    """Preventable failures, arrivals and the time lost."""
    if rows.empty:
        return ["", "", ""]
    kinds = [failure_kind(row) for row in rows.to_dict("records")]
    tests = int(rows["outcome"].isin(["held", "violated"]).sum())
    ended, lost = rows["arrived"].dropna(), rows["lost_s"].dropna()
    return [
        told(kinds.count(PREVENTABLE), tests),
        f"{int(ended.sum())} of {len(ended)}",
        f"{lost.mean():.1f}" if len(lost) else "",
    ]


def told(count: int, total: int) -> str:
    """A count with the interval of its share."""
    found = rate(count, total)
    if found.low is None or found.high is None:
        return f"{count} of {total}"
    return f"{count} of {total} [{100 * found.low:.0f}, {100 * found.high:.0f} %]"


def table_by_test(found: dict[str, pd.DataFrame]) -> str:
    """The second table: a line for each driver, a column for each test."""
    tests = list(dict.fromkeys(test for cases in found.values() for test in cases["test"]))
    rows = [["ego", *tests], ["---"] * (1 + len(tests))]
    for name, cases in found.items():
        judged = cases[cases["avoided"].notna()]
        rows.append([name, *(cell(judged[judged["test"] == test]) for test in tests)])
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def cell(cases: pd.DataFrame) -> str:
    """Avoided of judged cases, and the mean impact speed."""
    impacts = cases.loc[cases["avoided"] == 0, "impact_kmh"]
    speed = f", {impacts.mean():.0f}" if len(impacts) else ""
    return f"{int(cases['avoided'].sum())}/{len(cases)}{speed}"


if __name__ == "__main__":
    main()
