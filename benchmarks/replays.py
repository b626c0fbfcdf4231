"""Random rows of a batch with several agents and networks, replayed: does any diverge?

    python benchmarks/replays.py [--replays 200] [--runs N] [--seed N]

Batches are played into a temporary folder: pedestrians and cars, SUMO's driver and a controller, a
learner, lights and drawn traffic, on the networks that come with cavsumo. Then rows are drawn
from all of them, by an own generator, and each is played again in another process and compared, bit
for bit: half of them from their results, half from their traces alone.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

from cavsumo.batch.executors import Means
from cavsumo.batch.preflight import Manner
from cavsumo.batch.prepared import prepare
from cavsumo.batch.replay import compare, recorded, recorded_alone, replayed
from cavsumo.batch.worker import Worker
from cavsumo.cli.commands.run import run
from cavsumo.errors import DivergenceError
from cavsumo.results.reading import read_rows

ROOT = Path(__file__).resolve().parent.parent
LEARNING = "q-learning"  # replayed from the results, its every earlier episode is played again

BATCHES: dict[str, dict[str, Any]] = {
    "crossing": {"net": "crossing", "agents": ["random", "proximity", "timing", "election"]},
    "junction, left, drawn traffic": {
        "net": "junction",
        "agents": ["timing", "programmed-random"],
        "ego_route": "left",
        "signal": "green",
        "traffic": "6",
    },
    "junction, cars": {"net": "junction", "agents": ["timing", "proximity"], "kind": "car"},
    "crossing, time-gap ego": {"net": "crossing", "agents": ["timing"], "ego": "time-gap"},
    "straight road, learner": {"net": "pedestrians", "agents": ["noop", LEARNING]},
}


def main() -> None:
    """Play, replay and print the table; exit status 1 when any diverged."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--replays", type=int, default=200)
    parser.add_argument("--runs", type=int, default=20, help="episodes an agent in each batch")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        files = {name: batch(name, options, Path(folder) / f"{i}.csv")
                 for i, name in enumerate(BATCHES)}  # fmt: skip
        every = [(name, int(row["run"])) for name, file in files.items() for row in read_rows(file)]
        drawn = random.Random(options.seed).sample(every, options.replays)
        workers: dict[tuple[str, bool], Worker] = {}
        counts: Counter[tuple[str, str]] = Counter()
        begun = time.perf_counter()
        for i, (name, number) in enumerate(drawn):
            what = again(name, files[name], number, bool(i % 2), workers)
            counts[name, what] += 1
            counts["all", what] += 1
        spent = time.perf_counter() - begun
        for worker in workers.values():
            worker.close()
    report(counts, options.replays, spent)
    sys.exit(any(what == "diverged" for _, what in counts))


def batch(name: str, options: argparse.Namespace, file: Path) -> Path:
    """Play a batch."""
    settings = dict(BATCHES[name])
    settings["net"] = ROOT / "networks" / f"{settings['net']}.net.xml"
    settings |= {"runs": options.runs, "seed": options.seed, "trace": "all"}
    run(settings, file, Means(), Manner(quiet=True, exit_zero=True))
    return file


def again(
    name: str, file: Path, number: int, alone: bool, workers: dict[tuple[str, bool], Worker]
) -> str:
    """Replay a row: how it was replayed, or that it diverged."""
    record = recorded(file, number)
    if alone:
        record = recorded_alone(file.parent / record.row["trace"])
    if (name, alone) not in workers:
        workers[name, alone] = Worker(prepare(record.plan))
    try:
        compare(record, replayed(workers[name, alone], record))
    except DivergenceError as error:
        print(f"{name}: {error}")
        return "diverged"
    return "trace alone" if alone else "results"


def report(counts: Counter[tuple[str, str]], replays: int, spent: float) -> None:
    """The table."""
    columns = ("results", "trace alone", "diverged")
    print(f"{'batch':32}" + "".join(f"{column:>13}" for column in columns))
    for name in (*BATCHES, "all"):
        print(f"{name:32}" + "".join(f"{counts[name, column]:13}" for column in columns))
    print(f"{replays} replays in {spent:.0f} s")


if __name__ == "__main__":
    main()
