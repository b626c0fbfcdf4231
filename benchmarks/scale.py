"""A report with its page, a merge and a resumed batch of very many rows: time and memory.

    python benchmarks/scale.py [--rows N] [--played N] [--other FOLDER] [--what NAME]...

Episodes are played once; their rows are repeated under the run numbers and seeds that a batch of
that size has, as one results file and as two shards. Each command is a process of its own;
processor time is user and system together, memory the largest resident size. Another checkout of
cavsumo (``--other``) takes turns, and must write the same bytes.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

from cavsumo.model.scenario import BatchPlan
from cavsumo.model.seeds import episode_seed

ROOT = Path(__file__).resolve().parent.parent
NET = ROOT / "networks" / "crossing.net.xml"
AGENTS = ("random", "timing")


class Spent(NamedTuple):
    """What a command took: processor time [s], largest resident size [MB]."""

    seconds: float
    megabytes: float


def main() -> None:
    """Play, repeat, measure; exit status 1 where two checkouts differ."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--played", type=int, default=200, help="episodes an agent")
    parser.add_argument("--other", type=Path, help="another checkout to compare with")
    parser.add_argument("--what", action="append", choices=COMMANDS, help="all by default")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        grown(played(folder, options.played), folder, options.rows)
        checkouts = [ROOT, *([options.other.resolve()] if options.other else [])]
        print(f"{options.rows} rows, {(folder / 'all.csv').stat().st_size / 1e6:.0f} MB")
        chosen = options.what or COMMANDS
        same = all([measured(what, folder, checkouts) for what in chosen])
    sys.exit(0 if same else 1)


# The commands, and the files that they write.
COMMANDS: dict[str, tuple[str, tuple[str, ...]]] = {
    "report": ("report all.csv --html page.html", ("page.html",)),
    "merge": ("merge part0.csv part1.csv -o merged.csv --overwrite", ("merged.csv", "merged.json")),
    "resume": ("run --resume -q --exit-zero -o all.csv", ("all.csv", "all.json")),
}


def played(folder: Path, runs: int) -> Path:
    """The results of episodes that are really played."""
    words = ["run", "-n", str(NET), "--runs", str(runs), "--trace", "none", "-q", "--exit-zero"]
    words += [word for agent in AGENTS for word in ("--agent", agent)]
    run(ROOT, [*words, "-o", "played.csv"], folder)
    return folder / "played.csv"


def grown(small: Path, folder: Path, rows: int) -> None:
    """The rows repeated: ``all.csv``, and its halves ``part0.csv`` and ``part1.csv``."""
    with small.open(encoding="utf-8", newline="") as stream:
        header, *found = csv.reader(stream)
    manifest = json.loads(small.with_suffix(".json").read_text(encoding="utf-8"))
    manifest["plan"] |= {"runs": rows // len(AGENTS)}
    seed = header.index("seed")
    for name, shard in (("all", None), ("part0", "1/2"), ("part1", "2/2")):
        plan = {**manifest["plan"], "shard": shard}
        text = json.dumps({**manifest, "plan": plan}, indent=1)
        (folder / f"{name}.json").write_text(text, encoding="utf-8")
        checked = BatchPlan.model_validate(plan)
        with (folder / f"{name}.csv").open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(header)
            for run_number in checked.todo():
                row = found[run_number % len(found)].copy()
                row[0] = str(run_number)
                row[seed] = str(episode_seed(checked.seed, run_number // len(AGENTS)))
                writer.writerow(row)


def measured(what: str, folder: Path, checkouts: list[Path]) -> bool:
    """Print what a command takes in each checkout; whether all write the same."""
    line, files = COMMANDS[what]
    digests, said = set(), []
    for checkout in checkouts:
        spent, out = run(checkout, line.split(), folder)
        written = [(folder / file).read_bytes() for file in files]
        digests.add(hashlib.sha256(b"".join([out, *written])).hexdigest())
        said.append(f"{spent.seconds:7.1f} s {spent.megabytes:6.0f} MB")
    same = ", the same bytes" if len(digests) == 1 else ", OTHER BYTES"
    print(f"{what:8}" + "  other:".join(said) + (same if len(said) > 1 else ""), flush=True)
    return len(digests) == 1


def run(checkout: Path, words: list[str], folder: Path) -> tuple[Spent, bytes]:
    """Run a command of a checkout in a folder: what it took, and what it printed."""
    environment = os.environ | {"PYTHONPATH": str(checkout), "OPENBLAS_NUM_THREADS": "1"}
    with tempfile.TemporaryFile() as out:
        process = subprocess.Popen(
            [sys.executable, "-m", "cavsumo", *words], cwd=folder, env=environment, stdout=out
        )
        _, status, use = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            raise RuntimeError(f"cavsumo {' '.join(words)}: exit status {process.returncode}")
        out.seek(0)
        return Spent(use.ru_utime + use.ru_stime, use.ru_maxrss / 1024), out.read()


if __name__ == "__main__":
    main()
