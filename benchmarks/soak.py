"""A long batch whose workers are killed at random moments: is anything lost, does memory grow?

    python benchmarks/soak.py [--episodes N] [--kills-every S] [--quiet N] [-j N] [--seed N]

Short episodes (a tester on the straight road, over after two seconds) are played in worker
processes, of which one gets SIGKILL after a random time with the given mean. Each death may cost
one row, which says error; --retry-errors plays those again. Where workers die again and again as
they start, the batch ends with a sentence, and is resumed. Then every episode must have its row,
the first ones those of a batch left in peace. Sizes are printed at every tenth.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from chaos import Rows, children, rows
from memory import lines, resident

NET = Path(__file__).resolve().parent.parent / "networks" / "pedestrians.net.xml"
POLL_S = 0.1
MOST_SESSIONS = 100


def main() -> None:
    """Play, kill, print; exit status 1 if anything was lost."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--episodes", type=int, default=20_000)
    parser.add_argument("--kills-every", type=float, default=3.0, metavar="S")
    parser.add_argument("--quiet", type=int, default=1_000, help="episodes to compare with")
    parser.add_argument("-j", "--jobs", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1, help="of the moments of the kills")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        quiet, wild = Path(folder, "quiet.csv"), Path(folder, "wild.csv")
        subprocess.run(command(quiet, min(options.quiet, options.episodes), 1), check=False)
        play = command(wild, options.episodes, options.jobs)
        print("   rows  kills  parent               the largest worker", flush=True)
        soak = Soak(wild, options)
        for session in range(MOST_SESSIONS):
            soak.session([*play, *(["--resume"] if session else [])])
            if lines(wild) >= options.episodes:
                break
        killed = rows(wild)
        subprocess.run([*play, "--retry-errors"], check=False)
        print(f"{options.episodes} episodes, {soak.kills} workers killed, {session} times resumed")
        sys.exit(0 if whole(options.episodes, rows(quiet), killed, rows(wild)) else 1)


def command(file: Path, episodes: int, jobs: int) -> list[str]:
    """A batch, whose first episodes are the same for any number of them."""
    words = ["run", "-n", str(NET), "-r", "none", "--runs", str(episodes), "--end", "2"]
    words += ["--testers", "1", "--agent", "random", "--trace", "none", "-q", "-j", str(jobs)]
    return [sys.executable, "-m", "cavsumo", *words, "-o", str(file)]


class Soak:
    """Kills workers of a batch at random moments; ``kills`` of them died."""

    def __init__(self, file: Path, options: argparse.Namespace) -> None:
        self.file, self.kills = file, 0
        self._rng, self._pause = random.Random(options.seed), options.kills_every
        self._marks = [options.episodes * tenth / 10 for tenth in range(1, 11)]

    def session(self, line: list[str]) -> None:
        """Play until the batch ends, and print the sizes at every tenth."""
        before, process = lines(self.file), subprocess.Popen(line)
        due = self._due()
        while process.poll() is None:
            time.sleep(POLL_S)
            workers, done = children(process.pid), lines(self.file)
            # a death before the first row would end the command with a sentence
            if done > before and workers and time.monotonic() >= due:
                self.kills += killed(self._rng.choice(workers))
                due = self._due()
            if self._marks and done >= self._marks[0]:
                self._marks = [mark for mark in self._marks if mark > done]
                print(f"{done:7} {self.kills:6}  {size(process.pid, workers)}", flush=True)

    def _due(self) -> float:
        """When the next worker dies."""
        return time.monotonic() + self._rng.expovariate(1.0 / self._pause)


def killed(worker: int) -> bool:
    """Whether a worker was there to be killed."""
    try:
        os.kill(worker, signal.SIGKILL)
    except ProcessLookupError:
        return False
    return True


def size(parent: int, workers: list[int]) -> str:
    """The memory of the processes, and the descriptors of the parent."""
    try:
        descriptors = sum(1 for _ in Path(f"/proc/{parent}/fd").iterdir())
    except OSError:  # it has just ended
        descriptors = 0
    largest = max(map(resident, workers), default="gone")
    return f"{resident(parent)} {descriptors:3} files  {largest}, of {len(workers)}"


def whole(episodes: int, quiet: Rows, killed: Rows, found: Rows) -> bool:
    """Print what is missing or different; whether nothing is."""
    outcome = found[0].index("outcome")
    errors = [sum(row[outcome] == "error" for row in some[1:]) for some in (killed, found)]
    missing = episodes - len(found[1:])
    ordered = [row[0] for row in found[1:]] == [str(run) for run in range(episodes)]
    changed = sum(a != b for a, b in zip(killed, found, strict=False) if a[outcome] != "error")
    different = sum(a != b for a, b in zip(quiet, found, strict=False))
    print(
        f"{errors[0]} errors, {errors[1]} after --retry-errors; {missing} rows missing, in order: "
        f"{ordered}; {changed} other rows changed by the retry; {different} of the first "
        f"{len(quiet) - 1} differ from a quiet batch"
    )
    return ordered and not (errors[1] or missing or changed or different)


if __name__ == "__main__":
    main()
