"""A batch whose processes are killed at random, against the same batch left in peace.

    python benchmarks/chaos.py [--runs N] [--kills-every S] [--folder FOLDER]

The workers get SIGKILL and SIGSTOP, the parent is killed twice and the batch resumed. The results
must be those of the quiet batch, but for the rows that say error; with --retry-errors, all of them.
"""

from __future__ import annotations

import argparse
import csv
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
NET = ROOT / "networks" / "crossing.net.xml"
Rows = list[list[str]]


def main() -> None:
    """Run both batches, compare them, print what happened."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=2000)
    parser.add_argument("--kills-every", type=float, default=3.0, metavar="S")
    parser.add_argument("--folder", type=Path, default=None)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.folder or Path(temporary)
        quiet, wild = folder / "quiet" / "results.csv", folder / "wild" / "results.csv"
        for file in (quiet, wild):
            file.parent.mkdir(parents=True)
        subprocess.run(command(options.runs, quiet), check=False)
        kills = disturbed(options.runs, wild, options.kills_every)
        report(rows(quiet), rows(wild), kills, "after the chaos")
        subprocess.run([*command(options.runs, wild), "--retry-errors"], check=False)
        report(rows(quiet), rows(wild), kills, "after --retry-errors")


def command(runs: int, file: Path) -> list[str]:
    """The batch."""
    words = ["run", "-n", str(NET), "--runs", str(runs), "-j", "2", "-q", "-o", str(file)]
    return [sys.executable, "-m", "cavsumo", *words, "--trace", "none", "--deadline", "5"]


def disturbed(runs: int, file: Path, every: float) -> Counter[str]:
    """Play the batch while its processes are killed; how often which was."""
    rng, kills = random.Random(1), Counter[str]()
    parent_dies_at = [runs // 3, 2 * runs // 3]
    process = subprocess.Popen([*command(runs, file), "--resume"])
    for _ in range(100_000):  # bounded; each turn waits
        try:
            process.wait(rng.uniform(0.5, 1.5) * every)
            if len(rows(file)) > runs:
                return kills
            kills["stopped with all attempts killed"] += 1
        except subprocess.TimeoutExpired:
            workers = children(process.pid)
            if parent_dies_at and len(rows(file)) > parent_dies_at[0]:
                parent_dies_at.pop(0)
                process.kill()
                process.wait()
                kills["parent, SIGKILL"] += 1
                time.sleep(0.5)
                kills["workers that outlived it"] += sum(map(alive, workers))
            elif workers:
                how = rng.choice((signal.SIGKILL, signal.SIGSTOP))
                os.kill(rng.choice(workers), how)
                kills[f"worker, {how.name}"] += 1
                continue
        if process.returncode is not None:
            process = subprocess.Popen([*command(runs, file), "--resume"])
    raise RuntimeError("the batch did not end")


def children(parent: int) -> list[int]:
    """The workers of a process."""
    found = []
    for folder in Path("/proc").iterdir():
        try:
            stat = (folder / "stat").read_text().rpartition(")")[2].split()
            words = (folder / "cmdline").read_bytes()
        except OSError:
            continue
        if folder.name.isdecimal() and int(stat[1]) == parent and b"worker_process" in words:
            found.append(int(folder.name))
    return found


def alive(pid: int) -> bool:
    """Whether a worker is still there."""
    try:
        return b"worker_process" in Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return False


def rows(file: Path) -> Rows:
    """The rows of a results file without wall_s, as far as they are whole."""
    if not file.exists():
        return []
    text = file.read_text(encoding="utf-8")
    return [row[:-1] for row in csv.reader(text[: text.rfind("\n") + 1].splitlines())]


def report(quiet: Rows, wild: Rows, kills: Counter[str], when: str) -> None:
    """Print how the two differ."""
    outcome = quiet[0].index("outcome")
    errors = [row for row in wild if row[outcome] == "error"]
    different = sum(a != b for a, b in zip(quiet, wild, strict=False) if b[outcome] != "error")
    said = ", ".join(f"{n} x {what}" for what, n in sorted(kills.items()))
    print(f"{when}: {len(wild) - 1} rows of {len(quiet) - 1}; {said}")
    print(f"  {len(errors)} errors; {different} other rows differ; equal: {quiet == wild}")


if __name__ == "__main__":
    main()
