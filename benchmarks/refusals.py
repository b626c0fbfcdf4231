"""CPU of refused commands, beside that of ``cavsumo --help``, each in a process of its own.

    python benchmarks/refusals.py [--rounds N] [--before CHECKOUT]

Commands take turns, so that whatever else the machine does hits all of them alike; what is printed
is the median over the rounds. With another checkout its commands take turns with these.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
HELP = "--help"
COMMANDS = (
    HELP,
    "report --format html",
    "run --help",
    "run --runs many",
    "run --runs 0",
    "run --agent timming",
    "run --ego constnat",
    "run --assert colision",
    "run --formula a=gap_mm>0",
    "run --param ami=1",
    "run --ego-param tua=1",
    "run --assert-param clear=1",
    "run --net crosing",
    "run --net nowhere.net.xml",
    "run --config nowhere.toml",
    "replay nowhere.csv 0",
    "report nowhere.csv",
    "certify nowhere.csv 0",
    "check-ego constnat --net crossing",
    "inspect crosing",
    "import-osm nowhere.osm -o town.net.xml",
    "game solve nowhere.json",
    "agents timming",
)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--before", type=Path, metavar="CHECKOUT")
    options = parser.parse_args()
    checkouts = [*([options.before] if options.before else []), ROOT]
    spent: dict[tuple[Path, str], list[float]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(options.rounds):
            for command in COMMANDS:
                for checkout in checkouts:
                    seconds = cpu(command, checkout, Path(folder))
                    spent.setdefault((checkout, command), []).append(seconds)
    median = {key: statistics.median(found) for key, found in spent.items()}
    print(f"{'cavsumo ...':40}" + "".join(f"{'CPU':>9}{'/ help':>8}" for _ in checkouts))
    for command in COMMANDS:
        cells = [
            f"{median[c, command]:7.2f} s{median[c, command] / median[c, HELP]:8.1f}"
            for c in checkouts
        ]
        print(f"{command:40}" + "".join(cells))


def cpu(command: str, checkout: Path, folder: Path) -> float:
    """CPU of a command that shows help or is refused [s]."""
    before = children_cpu()
    done = subprocess.run(
        [sys.executable, "-m", "cavsumo", *command.split()],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(checkout)},
        capture_output=True,
    )
    expected = 0 if HELP in command else 2
    if done.returncode != expected:
        raise RuntimeError(f"{command}: exit status {done.returncode}, expected {expected}")
    return children_cpu() - before


def children_cpu() -> float:
    """CPU of the processes that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
