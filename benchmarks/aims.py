"""Preventable and other failures that best-response finds by what it aims at.

    python benchmarks/aims.py --net crossing --runs 160

For each network and aim a batch that learns, on the same seeds; counted are the episodes after
those that explore.
"""

from __future__ import annotations

import argparse

import cavsumo
from cavsumo.results.statistics import rate

AIMS = ("preventable", "violation")
EXPLORED = 60


def line(net: str, aim: str, options: argparse.Namespace) -> str:
    """A line of the table."""
    played = cavsumo.run(
        net,
        routes=options.routes,
        agents=["best-response"],
        params={"best-response.aim": aim, "best-response.explore": options.explore},
        runs=options.runs,
        seed=options.seed,
        trace="none",
        jobs=1,
        progress=False,
    ).rows.iloc[options.explore :]
    failed = played[played["outcome"] == "violated"]
    count = int((failed["avoidable"] == 1).sum())
    share = rate(count, len(failed)) if len(failed) else None
    said = f"{share.value:6.0%} [{share.low:.0%}, {share.high:.0%}]" if share else ""
    tests, unfair = (played["outcome"] == "held").sum() + len(failed), played["outcome"] == "unfair"
    return (
        f"{net.split('/')[-1].removesuffix('.net.xml'):26}{aim:14}{len(played):6}{tests:7}"
        f"{unfair.sum():8}{len(failed):10}{count:13}{said:>18}"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--net", action="append", required=True)
    parser.add_argument("--routes", default=None)
    parser.add_argument("--runs", type=int, default=160)
    parser.add_argument("--explore", type=int, default=EXPLORED)
    parser.add_argument("--seed", type=int, default=101)
    options = parser.parse_args()
    print(
        f"{'net':26}{'aim':14}{'runs':>6}{'tests':>7}{'unfair':>8}{'failures':>10}"
        f"{'preventable':>13}{'of failures':>18}"
    )
    for net in options.net:
        for aim in AIMS:
            print(line(net, aim, options), flush=True)


if __name__ == "__main__":
    main()
