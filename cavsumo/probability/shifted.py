"""Learned shifts: normal numbers drawn around a mean that depends on the state, weighted exactly.

1. Play runs whose numbers are spread wider than by chance, so that some fail.
2. Fit shifts (``shifts``) to the numbers of failing runs, weighted by their likelihood ratios.
3. Play with the numbers of a mixture q of the shifts, weigh each run by its likelihood ratio

       p / q = 1 / sum over components of  share * product over steps of  N(n; m, s) / N(n; 0, 1)

   and fit again, to the failing runs of the last generations together. Parts of half a shift and
   of chance alone bound the weights.
4. Estimate from runs of their own, which learn nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from cavsumo.probability.noisy import (
    FAILED,
    RUNNING,
    NoisyProcess,
    SteppedEstimate,
    exploring_spread,
)
from cavsumo.probability.shifts import (
    IN_SQUARES,
    IN_TIME,
    FailingRuns,
    Shift,
    fitted,
    joined,
    latest,
)
from cavsumo.probability.tree import Floats, Ints
from cavsumo.probability.weights import LEVEL, contradicts, weighted

EXPLORED, LEARNED, RUNS = 4000, (2000,) * 2 + (4000,) * 6, 40_000  # of generations, the estimate
POOLED = 4  # generations from whose failing runs a shift is learned
EFFECTIVE = {IN_TIME: 150.0, IN_SQUARES: 300.0}  # failing runs that levelled weights are worth
SHARES = ((0.26, 1.0), (0.04, 0.5))  # of each shift: share and part of the mean
BY_CHANCE = 0.1  # share


class ShiftedPart(NamedTuple):
    """A part of a mixture: a part of a shift (with deviation 1 unless it is whole), or chance."""

    share: float
    shift: Shift | None = None
    part: float = 1.0

    def law(self, features: Floats, time: float) -> tuple[Floats, Floats]:
        """Means and deviations of the numbers."""
        if self.shift is None:
            return np.zeros(1), np.ones(1)
        mean = self.part * self.shift.mean(features, np.full(len(features), time))
        return mean, self.shift.deviation(time) if self.part == 1.0 else np.ones(1)


@dataclass(frozen=True, eq=False)
class ShiftedRuns:
    """Runs of a process.

    Attributes:
        terms: 1{failure} p / q of each run.
        failing: the steps of the failing runs.
        steps: of all runs.
    """

    terms: Floats
    failing: FailingRuns
    steps: int


def estimate_by_shifts(
    process: NoisyProcess, rng: np.random.Generator, runs: int = RUNS, level: float = LEVEL
) -> SteppedEstimate:
    """The probability that a process fails; ``runs`` are those of the estimate.

    Refused where the weights are worth few failures or it contradicts its last pilot.
    """
    seen = [explored_runs(process, EXPLORED, rng)]
    for count in (*LEARNED, runs):
        seen.append(shifted_runs(process, learned_mixture(seen), count, rng))
    pilot, found = weighted(seen[-2].terms, 0.999), weighted(seen[-1].terms, level)
    found = replace(found, episodes=sum(len(one.terms) for one in seen))
    if not found.refused and not pilot.refused and contradicts(pilot, found):
        found = replace(found, refused="the estimate contradicts its pilot")
    return SteppedEstimate(found, sum(one.steps for one in seen))


def learned_mixture(seen: Sequence[ShiftedRuns]) -> tuple[ShiftedPart, ...]:
    """The mixture that fits the failing runs of the last generations; exploration helps once."""
    kept = [one.failing for one in (seen[1:] or seen)[-POOLED:] if one.failing.count]
    if not kept:
        return (ShiftedPart(1.0),)
    runs = joined(kept)
    shifts = [fitted(form, runs, effective) for form, effective in EFFECTIVE.items()]
    shifts.append(fitted(IN_TIME, latest(runs), EFFECTIVE[IN_TIME]))
    parts = [ShiftedPart(share, one, part) for one in shifts for share, part in SHARES]
    return (*parts, ShiftedPart(BY_CHANCE))


def explored_runs(process: NoisyProcess, count: int, rng: np.random.Generator) -> ShiftedRuns:
    """Play runs whose numbers are spread wider than by chance, each by a factor of its own."""
    spread = exploring_spread(count, rng)

    def law(go: Ints, features: Floats, step: int) -> tuple[Floats, Floats]:
        drawn = spread[go, None] * rng.standard_normal((len(go), process.numbers))
        ratio = 0.5 * (drawn**2).sum(1) * (1.0 - spread[go] ** -2)
        return drawn, (ratio - process.numbers * np.log(spread[go]))[None]

    return _played(process, count, np.ones(1), law)


def shifted_runs(
    process: NoisyProcess, mixture: Sequence[ShiftedPart], count: int, rng: np.random.Generator
) -> ShiftedRuns:
    """Play runs whose numbers are drawn by a mixture, as many by each component as its share."""
    shares = np.array([one.share for one in mixture])
    own = np.searchsorted(np.cumsum(shares)[:-1], (np.arange(count) + 0.5) / count)

    def law(go: Ints, features: Floats, step: int) -> tuple[Floats, Floats]:
        laws = [one.law(features, step / process.horizon) for one in mixture]
        drawn = rng.standard_normal((len(go), process.numbers))
        for number, (mean, deviation) in enumerate(laws):
            mine = own[go] == number
            drawn[mine] = np.broadcast_to(mean, drawn.shape)[mine] + deviation * drawn[mine]
        return drawn, np.array([_ratio(drawn, *one) for one in laws])

    return _played(process, count, shares, law)


def _ratio(drawn: Floats, mean: Floats, deviation: Floats) -> Floats:
    """The logarithm of a normal density over that of chance, at rows of numbers."""
    terms = 0.5 * drawn**2 - 0.5 * ((drawn - mean) / deviation) ** 2 - np.log(deviation)
    found: Floats = terms.sum(1)
    return found


def _played(
    process: NoisyProcess,
    count: int,
    shares: Floats,
    law: Callable[[Ints, Floats, int], tuple[Floats, Floats]],
) -> ShiftedRuns:
    """Play runs; ``law`` draws for running ones, and says log q / p of each component."""
    states, logs = process.begin(count), np.zeros((len(shares), count))
    rows = list[tuple[Ints, Floats, Floats]]()
    for step in range(process.horizon):
        go: Ints = np.flatnonzero(states[:, -1] == RUNNING)
        if not len(go):
            break
        features = process.features(states[go])
        drawn, ratios = law(go, features, step)
        logs[:, go] += ratios
        rows.append((go, features, drawn))
        states[go] = process.moved(states[go], drawn)
    failed = states[:, -1] == FAILED
    ratio = -np.logaddexp.reduce(logs + np.log(shares)[:, None], axis=0)
    terms = np.where(failed, np.exp(np.where(failed, ratio, 0.0)), 0.0)
    steps = sum(len(go) for go, _, _ in rows)
    return ShiftedRuns(terms, _of_failing(failed, ratio, rows, process.horizon), steps)


def _of_failing(
    failed: np.ndarray, ratio: Floats, rows: list[tuple[Ints, Floats, Floats]], horizon: int
) -> FailingRuns:
    """The steps of those runs that failed."""
    number = np.cumsum(failed) - 1
    kept = [(go[failed[go]], f[failed[go]], d[failed[go]]) for go, f, d in rows]
    return FailingRuns(
        logs=ratio[failed] - np.log(len(failed)),
        features=np.concatenate([features for _, features, _ in kept]),
        times=np.repeat(np.arange(len(kept)) / horizon, [len(go) for go, _, _ in kept]),
        drawn=np.concatenate([drawn for _, _, drawn in kept]),
        owner=number[np.concatenate([go for go, _, _ in kept])],
    )
