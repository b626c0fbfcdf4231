"""The suites ``cav-gym`` and ``chance-2019`` beside the published shares of tests.

    python benchmarks/street_suites.py [--suite NAME ...] [--draws 50] [-j 2]

An ego that keeps its speed; a test is an episode in which a pedestrian enters the reaction zone
before any enters the braking zone or the ego. Wilson intervals of 95 %.
"""

from __future__ import annotations

import argparse

import cavsumo
from cavsumo.results.statistics import rate

TESTERS = ("random", "programmed-random", "proximity", "election")
# Shares of tests [%] by the number of pedestrians: CAV-Gym's, played 250 times each
# (experiments/peers.csv), and those of the table of Chance et al., 1000 each.
PUBLISHED = {
    "cav-gym": {
        "random": {1: 2.0, 3: 10.4, 6: 19.6},
        "programmed-random": {1: 28.0, 3: 45.2, 6: 53.6},
        "proximity": {1: 30.4, 3: 50.4, 6: 54.4},
        "election": {1: 30.4, 3: 29.6, 6: 20.4},
    },
    "chance-2019": {
        "random": {1: 16.0, 3: 42.7, 6: 68.3, 10: 83.3},
        "programmed-random": {1: 23.4, 3: 56.0, 6: 81.7, 10: 93.4},
        "proximity": {1: 46.9, 3: 85.5, 6: 97.8, 10: 99.8},
        "election": {1: 49.1, 3: 71.7, 6: 85.4, 10: 91.1},
    },
}


def main() -> None:
    """Print a line for each tester and number of pedestrians."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--suite", action="append", choices=PUBLISHED)
    parser.add_argument("--draws", type=int, default=50)
    parser.add_argument("-j", "--jobs", type=int, default=2)
    options = parser.parse_args()
    print(f"{'suite':12}{'tester':18}{'n':>3}  {'tests [95 %]':24}{'unfair':>7}{'published':>11}")
    for suite in options.suite or PUBLISHED:
        for tester in TESTERS:
            for line in lines(suite, tester, options.draws, options.jobs):
                print(line, flush=True)


def lines(suite: str, tester: str, draws: int, jobs: int) -> list[str]:
    """The lines of a tester."""
    published = PUBLISHED[suite][tester]
    only = [f"{tester}/{n}/{draw}" for n in published for draw in range(1, draws + 1)]
    rows = cavsumo.suite(suite, "constant", only=only, jobs=jobs, progress=False, trace="none").rows
    numbers = rows["case"].str.split("/").str[1].astype(int)
    found = []
    for n, there in published.items():
        outcomes = rows.loc[numbers == n, "outcome"]
        tests = rate(int(outcomes.isin(["held", "violated"]).sum()), len(outcomes))
        value, low, high = (100 * (share or 0.0) for share in (tests.value, tests.low, tests.high))
        share = f"{value:.0f} % [{low:.1f}, {high:.1f}]"
        unfair = int((outcomes == "unfair").sum())
        found.append(f"{suite:12}{tester:18}{n:3}  {share:24}{unfair:7}{there:9.1f} %")
    return found


if __name__ == "__main__":
    main()
