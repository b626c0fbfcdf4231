"""The careful driver of UN R157 on the grids of the suite: how many collisions it cannot avoid.

    python benchmarks/un_r157.py [--test NAME]

The counts are to be compared with those of the public reference implementation, JRC-FSM.
"""

from __future__ import annotations

import argparse

from cavsumo.suites.careful_driver import (
    cut_in_preventable,
    cut_out_preventable,
    deceleration_preventable,
)
from cavsumo.suites.cells import all_cells
from cavsumo.suites.expressions import Value
from cavsumo.suites.files import read_suite, suite_file

# Collisions of the reference implementation's careful driver, by test.
PUBLISHED = {"cut-in": 3728, "cut-in-high": 3552, "deceleration": 0}


def prevented(test: str, cell: dict[str, Value]) -> bool:
    """Whether the driver avoids a cell."""
    number = {key: float(value) for key, value in cell.items()}
    ego = number["ego_kmh"] / 3.6
    if test == "deceleration":
        return deceleration_preventable(ego, number["braking_g"] * 9.81)
    if test == "cut-out":
        return cut_out_preventable(ego, number["gap_m"], number["lateral_mps"])
    other = number["other_kmh"] / 3.6
    return cut_in_preventable(ego, other, number["gap_m"], number["lateral_mps"])


def main() -> None:
    """Print a line for each test."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--test", action="append")
    suite = read_suite(suite_file("un-r157"))
    chosen = parser.parse_args().test or [test.name for test in suite.tests]
    print(f"{'test':14}{'cases':>8}{'collisions':>12}{'published':>11}")
    for name in chosen:
        cells = [cell.parameters for cell in all_cells(suite) if cell.test.name == name]
        collisions = sum(not prevented(name, cell) for cell in cells)
        print(f"{name:14}{len(cells):8,}{collisions:12,}{PUBLISHED.get(name, ''):>11}")


if __name__ == "__main__":
    main()
