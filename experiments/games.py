"""The table of the testers that play games, in README.md.

    python experiments/games.py games-*.csv

The files are the results of ``cavsumo run -c experiments/games.toml -o games.csv``, one for each
place and number of testers.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

from tables import cell_of, headed, line, named, plain, span, write_tables

from cavsumo.report.analysis import Report, analyse
from cavsumo.report.rates import Rates, share


def main() -> None:
    """Read the results, write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", nargs="+", type=Path)
    files = parser.parse_args().results
    write_tables({"games": table(analyse(sorted(files, key=cell_of)))})


def table(report: Report) -> Iterator[str]:
    """Tests, failures, unfair episodes and cost, a line for each place, number and tester."""
    titles = ["place", "pedestrians", "tester", "tests in %", "failures in %", "unfair in %"]
    yield from headed([*titles, "cost [s]", "episodes"])
    for group, one in zip(report.groups, report.rates, strict=True):
        place, testers = named(one.setting)
        cost = f"{group.valid['cost'].astype(float).mean():.1f}"
        yield line([place, str(testers), one.agent, *shares(one), cost, str(one.episodes)])


def shares(one: Rates) -> Iterator[str]:
    """What was found in an episode."""
    failures = share(one.failures.count, one.tests.total, "valid episodes", sequential=False)
    yield f"**{plain(one.tests)}** {span(one.tests)}"
    yield f"{plain(failures)} {span(failures)}"
    yield f"{plain(one.unfair)} {span(one.unfair)}"


if __name__ == "__main__":
    main()
