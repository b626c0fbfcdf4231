"""Estimators over time on published crosswalks, whose every step is disturbed by noise.

``yielding``: the crosswalk of SPAIS (Delecki et al., arXiv 2412.02154) with the numbers of its
public code; published 5.9e-5. ``start-2``, ``start-3``: starting points of ``ast-crosswalk``.
The truth is a long run of plain Monte Carlo, given with ``--truth`` (episodes) or ``--counted``
(failures and episodes of an earlier one); with ``--published`` it is the published reference.

Then each estimator, from other seeds: its mean over the truth, how many estimates are within 10 %
of it, how often an interval that is not refused meets that of the truth, episodes and steps with
all learning, and the gain: steps of Monte Carlo for the same standard deviation over those of the
estimator.
"""

from __future__ import annotations

import argparse
import math

import numpy as np

from cavsumo.model.crosswalk import STARTS
from cavsumo.probability.disturbed_crosswalk import DisturbedCrosswalk
from cavsumo.probability.learned_splitting import REPLICAS, estimate_by_splitting
from cavsumo.probability.monte_carlo import exact_estimate
from cavsumo.probability.noisy import counted
from cavsumo.probability.shifted import estimate_by_shifts
from cavsumo.probability.weights import Estimate
from cavsumo.probability.yielding_crosswalk import YieldingCrosswalk

PROCESSES = {
    "start-2": DisturbedCrosswalk(STARTS[1]),
    "start-3": DisturbedCrosswalk(STARTS[2]),
    "yielding": YieldingCrosswalk(),
}
PUBLISHED = 5.9e-5
ESTIMATORS = {
    "shifts": lambda process, rng, runs: estimate_by_shifts(process, rng, runs),
    "splitting": lambda process, rng, runs: estimate_by_splitting(
        process, rng, runs=max(10, runs // REPLICAS)
    ),
}


def main() -> None:
    """Print the truth and one row an estimator."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("process", choices=PROCESSES)
    parser.add_argument("--truth", type=int, default=10_000_000, help="episodes of Monte Carlo")
    parser.add_argument("--counted", type=int, nargs=2, metavar=("FAILURES", "EPISODES"))
    parser.add_argument("--published", action="store_true", help=f"{PUBLISHED:g}, of yielding")
    parser.add_argument("--method", action="append", choices=ESTIMATORS)
    parser.add_argument("--runs", type=int, default=20_000, help="of an estimate, after learning")
    parser.add_argument("--replications", type=int, default=20)
    asked = parser.parse_args()
    process = PROCESSES[asked.process]
    if asked.published and asked.process != "yielding":
        parser.error("--published: only yielding has a published reference")
    truth = _published() if asked.published else _truth(asked)
    print(_words(asked.process, truth))
    mean_steps = counted(process, 1000, np.random.default_rng(0)).steps / 1000
    print("method     mean/p  rel. sd  in 10 %  meets  refused  episodes    steps     gain")
    for method in asked.method or ESTIMATORS:
        streams = [np.random.default_rng((7, i)) for i in range(asked.replications)]
        found = [ESTIMATORS[method](process, rng, asked.runs) for rng in streams]
        print(f"{method:9}  {_row(found, truth, mean_steps)}", flush=True)


def _words(name: str, truth: Estimate) -> str:
    """The truth in words."""
    if not truth.episodes:
        return f"{name}: published: {truth.p:.3g}"
    return (
        f"{name}: {truth.failures} failures in {truth.episodes} episodes: "
        f"{truth.p:.3g} [{truth.lower:.3g}, {truth.upper:.3g}]"
    )


def _published() -> Estimate:
    """The published reference, of which neither failures nor episodes are known."""
    return Estimate(PUBLISHED, PUBLISHED, PUBLISHED, 0.95, 0, 0, 0.0, 1.0)


def _truth(asked: argparse.Namespace) -> Estimate:
    """The share of failures among episodes by chance, counted before or now."""
    if asked.counted:
        return exact_estimate(*asked.counted, 0.05, 0.95)
    rng = np.random.default_rng((1, list(PROCESSES).index(asked.process)))
    failures = counted(PROCESSES[asked.process], asked.truth, rng).failures
    return exact_estimate(failures, asked.truth, 0.05, 0.95)


def _row(found, truth, mean_steps: float) -> str:
    """The figures of an estimator."""
    each, kept = (
        [one.estimate for one in found],
        [o.estimate for o in found if not o.estimate.refused],
    )
    ratios = np.array([one.p for one in each]) / truth.p
    spread = float(ratios.std(ddof=1)) if len(ratios) > 1 else math.nan
    meets = [one.lower <= truth.upper and truth.lower <= one.upper for one in kept]
    steps = float(np.mean([one.steps for one in found]))
    gain = (1 - truth.p) / truth.p * mean_steps / steps / spread**2 if spread else math.nan
    return (
        f"{ratios.mean():6.3f}  {spread:7.3f}  {np.mean(np.abs(ratios - 1) <= 0.1):7.2f}  "
        f"{np.mean(meets) if meets else math.nan:5.2f}  {len(each) - len(kept):7}  "
        f"{np.mean([one.episodes for one in each]):8.0f}  {steps:8.3g}  {gain:7.2g}"
    )


if __name__ == "__main__":
    main()
