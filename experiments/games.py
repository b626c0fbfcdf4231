"""The table of the testers that play games, in README.md.

    python experiments/games.py games-*.csv

The files are the results of ``cavsumo run -c experiments/games.toml -o games.csv``, one for each
place and number of testers.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path
from statistics import fmean

from tables import cell_of, headed, line, named, plain, span, write_tables

from cavsumo.report.analysis import Report, analyse
from cavsumo.report.rates import Rates, share
from cavsumo.results.reading import read_rows

Costs = dict[tuple[str, int, str], list[float]]


def main() -> None:
    """Read the results, write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", nargs="+", type=Path)
    files = parser.parse_args().results
    write_tables({"games": table(analyse(sorted(files, key=cell_of)), costs(files))})


def costs(files: Iterable[Path]) -> Costs:
    """Time that the testers spent on the carriageway [s], by place, number and tester."""
    found: Costs = defaultdict(list)
    for file in files:
        for row in read_rows(file):
            if row["outcome"] not in ("error", "invalid"):
                found[(*named(file.stem), row["agent"])].append(float(row["cost"]))
    return found


def table(report: Report, costs: Costs) -> Iterator[str]:
    """Tests, failures, unfair episodes and cost, a line for each place, number and tester."""
    titles = ["place", "pedestrians", "tester", "tests in %", "failures in %", "unfair in %"]
    yield from headed([*titles, "cost [s]", "episodes"])
    for one in report.rates:
        place, testers = named(one.setting)
        cost = f"{fmean(costs[place, testers, one.agent]):.1f}"
        yield line([place, str(testers), one.agent, *shares(one), cost, str(one.episodes)])


def shares(one: Rates) -> Iterator[str]:
    """What was found in an episode."""
    failures = share(one.failures.count, one.tests.total, "valid episodes", sequential=False)
    yield f"**{plain(one.tests)}** {span(one.tests)}"
    yield f"{plain(failures)} {span(failures)}"
    yield f"{plain(one.unfair)} {span(one.unfair)}"


if __name__ == "__main__":
    main()
