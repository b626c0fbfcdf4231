"""Recorded episodes, played back from their traces alone: is every frame the same?

    python benchmarks/playback.py [--runs 25] [--seed N] [--batch NAME]

Batches with traffic are played into a temporary folder, on the networks that come with cavsumo:
pedestrians and vehicles as testers, SUMO's driver and controllers, drawn traffic, and a demand of
flows, random places, other speeds and types. Then each trace is copied into an empty folder, with
its network and without routes, and played back: its actions, its starts and its departures instead
of agents and demand. Every frame is compared bit for bit, the row but for what only agents decide.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cavsumo.batch.executors import Means
from cavsumo.batch.located import located
from cavsumo.batch.playback import NOT_PLAYED_BACK, for_playback, playback_job, played_back
from cavsumo.batch.preflight import Manner
from cavsumo.batch.replay import Record, Replayed, compare, prepared_again, recorded_alone
from cavsumo.batch.worker import Worker
from cavsumo.cli.commands.run import run
from cavsumo.errors import DivergenceError
from cavsumo.results.reading import read_rows

ROOT = Path(__file__).resolve().parent.parent
# What draws random numbers of SUMO's when it is read, and when it departs.
FLOWS = """<routes>
    <vTypeDistribution id="mix">
        <vType id="fast" vClass="passenger" sigma="0.9" speedFactor="normc(1.2,0.2,0.5,2)" tau="0.5"
               accel="4" probability="0.5"/>
        <vType id="truck" vClass="truck" length="9" maxSpeed="9" probability="0.5"/>
    </vTypeDistribution>
    <vType id="slow" vClass="pedestrian" maxSpeed="0.9" speedFactor="normc(1,0.3,0.5,2)"/>
    <flow id="w" type="mix" begin="0" end="100" probability="0.1" from="westbound" to="westbound"
          departLane="random" departSpeed="random" departPos="random"/>
    <flow id="e" begin="9" end="100" period="exp(0.1)" from="eastbound" to="eastbound"/>
    <personFlow id="p" type="slow" begin="0" end="90" period="4" departPos="random">
        <walk from="eastbound" to="westbound" arrivalPos="random"/>
    </personFlow>
    <personFlow id="q" begin="0" end="90" probability="0.2" departPos="random">
        <walk edges="westbound" arrivalPos="3"/>
    </personFlow>
</routes>
"""
BATCHES: dict[str, dict[str, Any]] = {
    "crossing": {"net": "crossing", "agents": ["timing", "random"]},
    "crossing, cars, drawn traffic": {"net": "crossing", "kind": "car", "traffic": "8"},
    "junction": {"net": "junction", "agents": ["proximity", "election"]},
    "junction, cars": {"net": "junction", "kind": "car", "agents": ["timing", "proximity"]},
    "junction, dense drawn traffic": {
        "net": "junction",
        "traffic": "40,60",
        "ego_route": "left",
        "signal": "green",
    },
    "pedestrians, time-gap ego": {"net": "pedestrians", "ego": "time-gap"},
    "pedestrians, learner": {"net": "pedestrians", "agents": ["q-learning"]},
    "pedestrians, flows": {"net": "pedestrians", "routes": "flows"},
}


def main() -> None:
    """Play, play back and print the table; exit status 1 when any differs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=25, help="episodes of each batch")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--batch", choices=BATCHES, action="append", help="only this one")
    options = parser.parse_args()
    print(f"{'batch':32}{'episodes':>10}{'frames':>10}{'departures':>12}{'the same':>10}")
    whole = [0, 0, 0, 0]
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        for i, name in enumerate(options.batch or BATCHES):
            counts = [0, 0, 0, 0]
            for one in batch_played_back(name, options, Path(folder) / str(i)):
                counts = [a + b for a, b in zip(counts, one, strict=True)]
            show(name, counts)
            whole = [a + b for a, b in zip(whole, counts, strict=True)]
    show("all", whole)
    print(f"in {time.perf_counter() - begun:.0f} s")
    sys.exit(whole[0] != whole[3])


def batch_played_back(
    name: str, options: argparse.Namespace, folder: Path
) -> Iterator[tuple[int, int, int, int]]:
    """A batch, each trace played back alone: episodes, frames, departures, those that are same."""
    traces = batch(name, options, folder)
    records = [alone(trace, folder / "alone") for trace in traces]
    with Worker(prepared_again(records[0])) as worker:
        for record in records:
            assert record.trace is not None
            job = playback_job(record)
            departures = job.recorded.departures if job.recorded else None
            if departures is None:
                raise SystemExit(f"{name}: departures do not tell all of its demand")
            number = len(departures.trips) + len(departures.walks)
            same = is_same(name, record, played_back(worker, record))
            yield 1, len(record.trace.frames), number, int(same)


def batch(name: str, options: argparse.Namespace, folder: Path) -> list[Path]:
    """Play a batch; its traces."""
    folder.mkdir()
    settings = dict(BATCHES[name])
    settings["net"] = ROOT / "networks" / f"{settings['net']}.net.xml"
    if settings.get("routes") == "flows":
        settings["routes"] = folder / "flows.rou.xml"
        settings["routes"].write_text(FLOWS, encoding="utf-8")
    agents = len(settings.get("agents", ("timing",)))
    settings |= {"runs": -(-options.runs // agents), "seed": options.seed, "trace": "all"}
    file = folder / "results.csv"
    run(settings, file, Means(), Manner(quiet=True, exit_zero=True))
    rows = [row for row in read_rows(file)][: options.runs]
    if any(row["outcome"] == "error" for row in rows):
        raise SystemExit(f"{name}: {next(row['error'] for row in rows if row['error'])}")
    return [folder / row["trace"] for row in rows]


def alone(trace: Path, folder: Path) -> Record:
    """A trace in a folder without routes; the network is found where it was."""
    folder.mkdir(exist_ok=True)
    record = for_playback(recorded_alone(Path(shutil.copy(trace, folder)), anew=False))
    assert record.plan.scenario.routes is None
    assert record.plan.scenario.traffic is None
    return located(record, None, None)


def is_same(name: str, record: Record, again: Replayed) -> bool:
    """Whether a playback is the recorded episode; what differs is printed."""
    try:
        compare(record, again, NOT_PLAYED_BACK)
    except DivergenceError as error:
        print(f"{name}: {error}")
        return False
    return True


def show(name: str, counts: list[int]) -> None:
    """A line of the table."""
    episodes, frames, departures, same = counts
    print(f"{name:32}{episodes:10}{frames:10}{departures:12}{same:10}", flush=True)


if __name__ == "__main__":
    main()
