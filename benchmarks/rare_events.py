"""The learned twist on a process whose failure probability is known exactly.

Each row is one process: how often the 95 % interval contains the truth, and how many steps plain
Monte Carlo needs for the same standard deviation, over the steps of the estimate, learning
included::

    gain = H (1 - p) / (p r^2 S)     H: horizon, S: mean steps, r: sd of the estimates over p
"""

from __future__ import annotations

import argparse
import math
from dataclasses import fields

import numpy as np

from cavsumo.probability.surrogate import Following, exact_probability
from cavsumo.probability.twist import estimate_by_twist

OTHERS = (  # egos and starts of our own choice
    Following(p3=0.0003),
    Following(p3=0.003, standstill=3, closing=1),
    Following(p3=0.003, closing=3, slack=1, hard=3),
    Following(p3=0.003, closing=1, near=6, hard=1),
    Following(p3=0.01, gap=20, ego=10, leader=10),
)


def main() -> None:
    """Print one row a process."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--replications", type=int, default=200)
    parser.add_argument("--runs", type=int, default=1000, help="of an estimate, after learning")
    parser.add_argument("--seed", type=int, default=1)
    for field in fields(Following):
        kind = float if field.name == "p3" else int
        parser.add_argument(f"--{field.name}", type=kind, help=f"default {field.default}")
    asked = vars(parser.parse_args())
    own = {name: asked[name] for name in Following.__dataclass_fields__ if asked[name] is not None}
    usual = (Following(p3=0.02), Following(p3=0.003), Following(p3=0.001), *OTHERS)
    print("p          mean/p  rel. sd  coverage  refused  steps      gain  process")
    for process in (Following(**own),) if own else usual:
        print(row(process, asked["replications"], asked["runs"], asked["seed"]), flush=True)


def row(process: Following, replications: int, runs: int, seed: int) -> str:
    """The row of a process."""
    truth = exact_probability(process)
    streams = np.random.SeedSequence(seed).spawn(replications)
    found = [estimate_by_twist(process, np.random.default_rng(one), runs) for one in streams]
    kept = [one.estimate for one in found if not one.estimate.refused]
    covered = sum(one.lower <= truth <= one.upper for one in kept)
    estimates = np.array([one.estimate.p for one in found]) / truth
    spread = float(estimates.std(ddof=1)) if len(found) > 1 else math.nan
    steps = float(np.mean([one.steps for one in found]))
    gain = process.horizon * (1 - truth) / (truth * spread**2 * steps)
    words = ", ".join(
        f"{field.name} {getattr(process, field.name)}"
        for field in fields(process)
        if field.name == "p3" or getattr(process, field.name) != field.default
    )
    share = covered / len(kept) if kept else math.nan
    return (
        f"{truth:.3e}  {estimates.mean():6.3f}  {spread:7.4f}  {share:8.3f}  "
        f"{len(found) - len(kept):7}  {steps:5.0f}  {gain:8.2g}  {words}"
    )


if __name__ == "__main__":
    main()
