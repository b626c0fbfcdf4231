"""Failures of one network on others: at how many places each applies, and how often it fails again.

    python benchmarks/transfer.py [--tests 10] [--runs 150] [--places 4] [--seeds 3] [-j N]

Preventable failures of SUMO's driver, found by the agent timing at crossing, are made minimal and
tried at crossing itself and on other networks, in the zone and in the phase of the record.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import pandas

import cavsumo

HOME = "crossing"
NETS = ("crossing", "junction", "pedestrians")


def failures(folder: Path, wanted: int, runs: int, jobs: int) -> list[Path]:
    """Minimal tests of the first preventable failures."""
    found = cavsumo.run(
        HOME, testers=2, runs=runs, output=folder / "home.csv", jobs=jobs, progress=False
    )
    rows = found.rows
    failed = rows[(rows["outcome"] == "violated") & (rows["avoidable"] == 1)]
    tests = []
    for run in failed["run"]:
        if len(tests) == wanted:
            break
        file = folder / f"run{run}.cavtest"
        cavsumo.minimise(folder / "home.csv", int(run), output=file)
        tests.append(file)
    return tests


def transferable(tests: Sequence[Path]) -> list[Path]:
    """The tests that have a relative form; the others are named."""
    from cavsumo.kept.transfer import transfer_parts
    from cavsumo.kept.transfer_order import TransferOrder

    kept = []
    for test in tests:
        try:
            transfer_parts(TransferOrder([str(test)], [HOME], places=1, seeds=1))
        except cavsumo.InputError as error:
            print(f"left out: {error}".replace(str(test.parent), "."))
        else:
            kept.append(test)
    return kept


def line(name: str, table: pandas.DataFrame) -> str:
    """A line of the table: sums and exact intervals of the rows of one network or form."""
    (row,) = table.to_dict("records")
    at = f"[{100 * row['fails_at_low']:.1f}, {100 * row['fails_at_high']:.1f}]"
    again = (
        f"{100 * row['again']:.1f} [{100 * row['again_low']:.1f}, {100 * row['again_high']:.1f}]"
    )
    return (
        f"| {name} | {row['places']} | {row['fails_at']} {at} | {row['episodes']} | "
        f"{row['failures']} | {again} |"
    )


def main() -> None:
    """Find, minimise, transfer; print a line for each network and form, and for each test."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--tests", type=int, default=10)
    parser.add_argument("--runs", type=int, default=150)
    parser.add_argument("--places", type=int, default=4)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--net", action="append")
    parser.add_argument("-j", "--jobs", type=int, default=1)
    options = parser.parse_args()
    nets = options.net or list(NETS)
    begun = time.process_time()
    with TemporaryDirectory() as folder:
        tests = failures(Path(folder), options.tests, options.runs, options.jobs)
        print(f"{len(tests)} minimal tests, {time.process_time() - begun:.0f} s in this process")
        tests = transferable(tests)
        print("| tests on | places | fail at [95 %] | episodes | failures | again % [95 %] |")
        print("| --- | --- | --- | --- | --- | --- |")
        for form in ("zone", "phase"):
            for net in nets:
                how = {"places": options.places, "seeds": options.seeds, "forms": [form]}
                found = cavsumo.transfer(tests, [net], jobs=options.jobs, progress=False, **how)
                whole = found.table[found.table["test"] == "all"]
                print(line(f"{net}, in the {form}", whole), flush=True)
                own = found.table[(found.table["test"] != "all") & (found.table["net"] == "all")]
                print(
                    " ".join(
                        f"{f}/{n}" for f, n in zip(own["fails_at"], own["places"], strict=True)
                    )
                )


if __name__ == "__main__":
    main()
