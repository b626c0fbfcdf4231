"""Resident memory of the process that runs a batch, and of one that simulates, early and late.

    python benchmarks/memory.py [--stubs N] [--episodes N]

First N stub episodes go through everything that a real batch has in its parent process: the order
of runs, progress, tally, results file. Then real episodes (one tester on the straight road, over
after half a second) are played, and both processes are measured.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

from chaos import children

from cavsumo.batch.batch_run import BatchRun
from cavsumo.batch.jobs import finished
from cavsumo.batch.messages import Answer
from cavsumo.batch.prepared import manifest, prepare
from cavsumo.model.scenario import plan_from
from cavsumo.results.columns import row_of
from cavsumo.results.rows import Outcome
from cavsumo.results.writing import Recorder

NET = Path(__file__).resolve().parent.parent / "networks" / "pedestrians.net.xml"


class Stubs(Executor):
    """Plays nothing: every episode is a test at once."""

    def submit(self, _: Any, prepared: Any, job: Any) -> Future[Any]:  # type: ignore[override]
        future: Future[Any] = Future()
        made = {"outcome": "held", "trigger_time_s": 1.0 + job.run % 97 / 10, "wall_s": 0.0}
        future.set_result(Answer(Outcome(row_of(finished(prepared.plan, job)) | made)))
        return future


def main() -> None:
    """Run both batches and print the sizes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--stubs", type=int, default=100_000)
    parser.add_argument("--episodes", type=int, default=5_000)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        stubs(options.stubs, Path(folder) / "stubs.csv")
        real(options.episodes, Path(folder) / "real.csv")


def stubs(episodes: int, file: Path) -> None:
    """A batch of stubs in this process."""
    prepared = prepare(plan_from({"net": NET, "agents": ["noop"], "runs": episodes}, "memory"))
    played = 0

    def stopped() -> bool:
        nonlocal played
        if batch_run.tally.rows >= played:
            print(f"{batch_run.tally.rows:7} stubs:    parent {resident('self')}", flush=True)
            played = {0: episodes // 100, episodes // 100: episodes // 10}.get(played, episodes)
        return False

    with Recorder(file) as recorder:
        batch_run = BatchRun(prepared, recorder, Stubs(), 2, stopped)
        batch_run.begin(manifest(prepared))
        batch_run.play()
        batch_run.end()
    print(f"{batch_run.tally.rows:7} stubs:    parent {resident('self')}")


def real(episodes: int, file: Path) -> None:
    """A batch of real episodes in processes of its own."""
    words = ["run", "-n", str(NET), "-r", "none", "--runs", str(episodes), "--end", "0.5"]
    words += ["--testers", "1", "--agent", "noop", "--trace", "none", "-q", "-o", str(file)]
    process = subprocess.Popen([sys.executable, "-m", "cavsumo", *words])
    for mark in (episodes // 100, episodes // 10, episodes * 99 // 100):
        while process.poll() is None and lines(file) < mark:
            time.sleep(0.05)
        parent, worker, *_ = *map(resident, (process.pid, *children(process.pid))), "gone"
        print(f"{lines(file):7} episodes: parent {parent}, worker {worker}")
    process.wait()


def lines(file: Path) -> int:
    """How many rows there are."""
    return file.read_bytes().count(b"\n") - 1 if file.exists() else 0


def resident(pid: int | str) -> str:
    """The resident size of a process in words; a process may have ended meanwhile."""
    status = Path(f"/proc/{pid}/status")
    for line in status.read_text().splitlines() if status.exists() else ():
        if line.startswith("VmRSS"):
            return f"{int(line.split()[1]) / 1024:6.1f} MB"
    return "gone"


if __name__ == "__main__":
    main()
