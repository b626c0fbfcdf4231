"""Adaptive multilevel splitting over time: runs that come near are continued, others are given up.

For processes that can be continued from a state (``noisy``). A replica has N runs, each with the
best score that it reached. Again and again, with Z the k-th smallest of them (k: a tenth), the K
runs with at most Z are replaced by copies of others, up to the moment at which those passed Z, and
go on from there by chance. When fewer than k are left below a failure,

    p = (1 - K1 / N) (1 - K2 / N) ... * (share that failed)

which is unbiased for any score (Brehier, Gazeau, Goudenege, Lelievre, Rousset 2016, Ann. Appl.
Probab. 26, 3559). The best score is the chance to fail (``learned_splitting``).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cavsumo.probability.noisy import FAILED, RUNNING, NoisyProcess, Visited
from cavsumo.probability.tree import Floats, Ints

GIVEN_UP = 0.1  # share of the runs at a level

Score = Callable[[Floats, int], Floats]  # of states after so many steps; any increasing scale


@dataclass
class Replicas:
    """Replicas of runs that are split together.

    Attributes:
        states: shape (replicas, runs, horizon + 1, columns); what ended stays where it ended.
        best: the best score up to each moment, shape (replicas, runs, horizon + 1).
        weights: the product of the shares that were kept, of each replica.
        begun, steps: how many runs were begun, and how many steps were played.
    """

    states: Floats
    best: Floats
    weights: Floats
    begun: int = 0
    steps: int = 0

    @property
    def failed(self) -> np.ndarray:
        """Which runs failed, shape (replicas, runs)."""
        found: np.ndarray = self.states[:, :, -1, -1] == FAILED
        return found

    @property
    def estimates(self) -> Floats:
        """The estimate of each replica."""
        found: Floats = self.weights * self.failed.mean(1)
        return found

    def visited(self) -> Visited:
        """The running states of all runs at each step."""
        steps = self.states.reshape(-1, *self.states.shape[2:]).swapaxes(0, 1)
        return [step[step[:, -1] == RUNNING] for step in steps[:-1]]


def split(
    process: NoisyProcess,
    score: Score,
    rng: np.random.Generator,
    replicas: int,
    runs: int,
    given_up: float = GIVEN_UP,
) -> Replicas:
    """Split runs until nearly all of each replica fail, or all have the same best score."""
    found = _begun(process, replicas, runs)
    rows = np.arange(replicas * runs)
    _play(process, score, found, rows, np.zeros(len(rows), dtype=int), rng)
    least = max(1, int(given_up * runs))
    active = np.arange(replicas)
    while len(active):
        active, rows, starts = _branched(found, active, least, rng)
        if len(rows):
            _play(process, score, found, rows, starts, rng)
    return found


def _begun(process: NoisyProcess, replicas: int, runs: int) -> Replicas:
    """Runs at their first states."""
    first = process.begin(replicas * runs)
    states = np.repeat(first[:, None, :], process.horizon + 1, axis=1)
    shape = (replicas, runs)
    return Replicas(
        states=states.reshape(*shape, *states.shape[1:]),
        best=np.zeros((*shape, process.horizon + 1)),
        weights=np.ones(replicas),
    )


def _branched(
    found: Replicas, active: Ints, least: int, rng: np.random.Generator
) -> tuple[Ints, Ints, Ints]:
    """Replace the runs of a level: the replicas that go on, the new runs and their starts."""
    runs = found.best.shape[1]
    going, rows, starts = list[int](), list[int](), list[int]()
    for one in active:
        top = found.best[one, :, -1]
        level = np.partition(top, least - 1)[least - 1]
        if found.failed[one].sum() > runs - least:
            continue
        lost, kept = np.flatnonzero(top <= level), np.flatnonzero(top > level)
        found.weights[one] *= len(kept) / runs
        if not len(kept):
            continue
        parents = rng.choice(kept, len(lost))
        at = (found.best[one, parents] > level).argmax(1)
        for mine, parent, start in zip(lost, parents, at, strict=True):
            for kind in (found.states, found.best):
                kind[one, mine, : start + 1] = kind[one, parent, : start + 1]
        going.append(int(one))
        rows += list(one * runs + lost)
        starts += list(at)
    return np.array(going, dtype=int), np.array(rows, dtype=int), np.array(starts, dtype=int)


def _play(
    process: NoisyProcess,
    score: Score,
    found: Replicas,
    rows: Ints,
    starts: Ints,
    rng: np.random.Generator,
) -> None:
    """Play runs, by their numbers, from moments on."""
    flat = found.best.shape[0] * found.best.shape[1]
    states, best = found.states.reshape(flat, *found.states.shape[2:]), found.best.reshape(flat, -1)
    at_first = rows[starts == 0]
    best[at_first, 0] = score(states[at_first, 0], 0)
    for step in range(int(starts.min()), process.horizon):
        now = rows[starts <= step]
        go = now[states[now, step, -1] == RUNNING]
        states[now, step + 1], best[now, step + 1] = states[now, step], best[now, step]
        if len(go):
            drawn = rng.standard_normal((len(go), process.numbers))
            states[go, step + 1] = process.moved(states[go, step], drawn)
            best[go, step + 1] = np.maximum(best[go, step], score(states[go, step + 1], step + 1))
        found.steps += len(go)
    found.begun += len(rows)
