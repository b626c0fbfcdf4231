"""Which failures could have been avoided, by agent, with egos that brake and one that does not.

    python benchmarks/avoidable.py [--runs N] [-j N] [--keep FOLDER]

Batches on the crossing: each agent against SUMO's driver, a time-gap controller and an ego that
keeps its speed, once for each reference driver; the episodes of the two are the same. With
``--keep`` the results and traces stay, to be replayed.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path

from cavsumo.batch.executors import Means
from cavsumo.batch.preflight import Manner
from cavsumo.batch.summary import interval, percent
from cavsumo.batch.tally import Found, Tally
from cavsumo.cli.commands.run import run
from cavsumo.results.reading import read_rows
from cavsumo.results.statistics import Rate, rate

ROOT = Path(__file__).resolve().parent.parent
EGOS = ("sumo", "time-gap", "constant")
AGENTS = ("random", "proximity", "timing", "election")
REFERENCES = ("human", "ideal")


def main() -> None:
    """Play and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=150, help="episodes an agent and ego")
    parser.add_argument("-j", "--jobs", type=int, default=2)
    parser.add_argument("--keep", type=Path, help="a folder for results and traces")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as aside:
        folder = options.keep or Path(aside)
        folder.mkdir(parents=True, exist_ok=True)
        print(f"{'ego':9} {'agent':10} tests  failures", end="")
        print("".join(f"  {f'avoidable, {name}':>28}   not" for name in REFERENCES))
        for ego in EGOS:
            found = [played(ego, name, options, folder) for name in REFERENCES]
            for agent in AGENTS:
                print(f"{ego:9} {agent:10}", *line([tally.agents[agent] for tally in found]))
            print(f"{ego:9} {'all':10}", *line([tally.all for tally in found]))


def played(ego: str, reference: str, options: argparse.Namespace, folder: Path) -> Tally:
    """What a batch with an ego and a reference driver found."""
    settings = {
        "net": ROOT / "networks" / "crossing.net.xml",
        "ego": ego,
        "agents": AGENTS,
        "params": {"random.between": "repeat"},  # who wanders about is the hardest to judge
        "runs": options.runs,
        "reference": reference,
        "trace": "tests" if options.keep else "none",
    }
    file = folder / f"{ego}-{reference}.csv"
    run(settings, file, Means(options.jobs), Manner(quiet=True, exit_zero=True))
    tally = Tally()
    for row in read_rows(file):
        tally.add(row)
    return tally


def line(found: list[Found]) -> Iterator[str]:
    """The cells of one agent: what it found, then what each reference driver says of it."""
    first = found[0]
    yield f"{first.tests:5}  {first.failures:8}"
    for one in found:
        judged: Rate = rate(one.preventable, one.preventable + one.unpreventable)
        share = f"{judged.count} {percent(judged.value)} {interval(judged)}" if judged.total else ""
        yield f" {share:>28}   {one.unpreventable:3}"


if __name__ == "__main__":
    main()
