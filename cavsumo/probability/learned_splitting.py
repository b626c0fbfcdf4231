"""Splitting by learned chances: the score of a run is its chance to fail from where it is.

1. Play runs whose numbers are spread wider than by chance.
2. Learn the chance to fail from the states that were visited (``failure_chances``).
3. Split a few runs by these chances; they visit states nearer to failures. Learn again, in rounds.
4. Estimate by independent replicas that learn nothing.

An estimate is unbiased even where the chances are wrong. Its spread is not known from within a
replica, so the interval is a t interval of their mean.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cavsumo.probability.failure_chances import (
    FailureChances,
    explored_states,
    joined_states,
    learned_chances,
)
from cavsumo.probability.noisy import NoisyProcess, SteppedEstimate
from cavsumo.probability.splitting import Replicas, split
from cavsumo.probability.tree import Floats
from cavsumo.probability.weights import LEVEL, Estimate, normal_interval

REPLICAS, RUNS = 20, 1000
EXPLORED, ROUNDS, PILOTS = 3000, 5, (4, 200)  # runs, rounds of learning, replicas and runs of each
AT_ONCE = 4000  # runs, so that the memory is bounded
LARGEST_SHARE = 0.3  # of the sum in one replica
FEWEST_REPLICAS = 8.0  # effective number, for a t interval


class LearnedScore(NamedTuple):
    """Chances to fail, with the runs that were begun and the steps that were played for them."""

    chances: FailureChances
    begun: int
    steps: int


def estimate_by_splitting(
    process: NoisyProcess,
    rng: np.random.Generator,
    replicas: int = REPLICAS,
    runs: int = RUNS,
    level: float = LEVEL,
) -> SteppedEstimate:
    """The probability that a process fails, by independent replicas of so many runs.

    Refused where few of the replicas carry the estimate.
    """
    learned = learned_score(process, rng)
    together = max(1, AT_ONCE // runs)
    parts = [
        split(process, learned.chances.log, rng, min(together, replicas - done), runs)
        for done in range(0, replicas, together)
    ]
    begun = learned.begun + sum(one.begun for one in parts)
    steps = learned.steps + sum(one.steps for one in parts)
    return SteppedEstimate(_estimate(parts, begun, level), steps)


def learned_score(process: NoisyProcess, rng: np.random.Generator) -> LearnedScore:
    """The chances to fail, from exploring runs and then from splitting by those learned so far."""
    visited = [explored_states(process, EXPLORED, rng)]
    begun, steps = EXPLORED, sum(map(len, visited[0]))
    learned = learned_chances(process, visited[0], rng)
    for _ in range(ROUNDS - 1):
        pilots = split(process, learned.chances.log, rng, *PILOTS)
        visited.append(pilots.visited())
        begun, steps = begun + pilots.begun, steps + learned.steps + pilots.steps
        learned = learned_chances(process, joined_states(visited), rng)
    return LearnedScore(learned.chances, begun, steps + learned.steps)


def _estimate(parts: list[Replicas], begun: int, level: float) -> Estimate:
    """The mean of the replicas, with a t interval."""
    each: Floats = np.concatenate([one.estimates for one in parts])
    mean, error = float(each.mean()), float(each.std(ddof=1)) / len(each) ** 0.5
    lower, upper = normal_interval(mean, error, len(each) - 1, level)
    total = float(each.sum())
    largest = float(each.max()) / total if total > 0.0 else 1.0
    effective = total**2 / float((each**2).sum()) if total > 0.0 else 0.0
    refused = ""
    if total == 0.0:
        refused = "no replica reached a failure"
    elif largest > LARGEST_SHARE:
        refused = f"one replica carries {largest:.0%} of the sum"
    elif effective < FEWEST_REPLICAS:
        refused = f"the replicas are worth only {effective:.1f}"
    failures = sum(int(one.failed.sum()) for one in parts)
    return Estimate(mean, lower, upper, level, begun, failures, effective, largest, refused)
