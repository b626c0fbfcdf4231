"""Failures that the learned opponent model finds, beside the timing tester.

For each network and ego: ``best-response`` learns for --train episodes on one seed (the first 60
explore, and it plans anew after every 60), then what it counted is played frozen on another seed,
and ``timing`` on the same. Prints a table.
"""

from __future__ import annotations

import argparse
import csv
import sys
import tempfile
from collections import Counter
from pathlib import Path

from cavsumo import cli
from cavsumo.errors import Exit
from cavsumo.results.statistics import rate

ROOT = Path(__file__).resolve().parent.parent
TRAIN_SEED, SEED = 101, 7


def main() -> None:
    """Train, play, compare."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--train", type=int, default=240, help="training episodes")
    parser.add_argument("--runs", type=int, default=100, help="episodes of each tester")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--net", nargs="+", default=["junction", "crossing"])
    parser.add_argument("--ego", nargs="+", default=["sumo", "time-gap"])
    options = parser.parse_args()
    print(
        f"{'':22}{'tester':15}  failures  rate, 95 %              tests  unfair, 95 %", flush=True
    )
    with tempfile.TemporaryDirectory() as folder:
        for net in options.net:
            for ego in options.ego:
                compare(net, ego, options, Path(folder))


def compare(net: str, ego: str, options: argparse.Namespace, folder: Path) -> None:
    """One network and ego."""
    model = folder / f"{net}-{ego}-learned.csv"
    play(net, ego, model, "--agent", "best-response", "--runs", options.train, "--seed", TRAIN_SEED)
    frozen = ("--param", "learn=false", "--param", f"model={model.with_suffix('.json')}")
    extent = ("--runs", options.runs, "--seed", SEED, "-j", options.jobs)
    for tester, params in (("timing", ()), ("best-response", frozen)):
        file = folder / f"{net}-{ego}-{tester}.csv"
        play(net, ego, file, "--agent", tester, *params, *extent)
        line(f"{net}, {ego}", tester, file)


def play(net: str, ego: str, file: Path, *words: object) -> None:
    """A batch."""
    base = ("run", "--net", ROOT / "networks" / f"{net}.net.xml", "--ego", ego, "-o", file)
    quiet = ("--trace", "none", "-q", "--exit-zero", "--deadline", 600)
    if cli.main([*map(str, (*base, *quiet, *words))]) != Exit.OK:
        sys.exit("a batch could not be played")


def line(where: str, tester: str, file: Path) -> None:
    """What came out."""
    with file.open(encoding="utf-8") as rows:
        outcomes = Counter(row["outcome"] for row in csv.DictReader(rows))
    n = sum(outcomes.values()) - outcomes["error"]
    failures, tests = outcomes["violated"], outcomes["violated"] + outcomes["held"]
    print(f"{where:22}{tester:15}  {failures:4}/{n:3}  {share(failures, n)}  {tests:6}  "
          f"{outcomes['unfair']:3} {share(outcomes['unfair'], n)}", flush=True)  # fmt: skip
    if outcomes["error"]:
        print(f"{outcomes['error']} episodes could not be played", flush=True)


def share(k: int, n: int) -> str:
    """A rate with its interval."""
    found = rate(k, n)
    if found.value is None or found.low is None or found.high is None:
        return "   none played"
    return f"{found.value:6.1%} [{100 * found.low:4.1f}, {100 * found.high:4.1f}]"


if __name__ == "__main__":
    main()
