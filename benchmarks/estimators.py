"""Estimators on functions of known probability: coverage, refusals, gain over Monte Carlo.

With ``--half-width`` they may end at any look, as ``cavsumo estimate`` does, and the coverage is
that of the interval with which each one ended; without it all episodes are played. The stratified
estimator knows where the functions with discrete parts (``pedestrian``, ``lights``) are cut.

Beside the methods of ``cavsumo estimate`` two that it does not offer: scrambled Sobol points (their
interval is that of independent points), and subset simulation (Au and Beck 2001; eight independent
runs, a t interval over them).
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri
from scipy.stats import qmc, t

from cavsumo.probability.methods import ESTIMATORS, estimator
from cavsumo.probability.protocol import Goal, PlayedVector
from cavsumo.probability.stratified import Cut

NEVER = 1e-9  # a half-width that is not reached
DIMENSION = 6
METHODS = (*ESTIMATORS, "sobol", "subset")
SUBSETS, KEPT, MOST_LEVELS = 8, 0.2, 12


class Function(NamedTuple):
    """A function that is above 0 where it fails, and its probability."""

    margin: Callable
    p: float
    cuts: tuple[Cut, ...] = ()


def corner(u):
    """A corner of three coordinates."""
    return 1e-4 ** (1 / 3) - u[:, :3].max(1)


def ball(u):
    """A ball of six dimensions."""
    return 0.17 - np.sqrt(((u - 0.3) ** 2).sum(1))


def corners(u):
    """Two corners, each of three coordinates."""
    return np.maximum(0.08 - u[:, :3].max(1), u[:, 3:].min(1) - 0.92)


def scattered(u):
    """Nowhere in particular, with no sign of coming near."""
    found = 1e-3 - (997.0 * u.sum(1)) % 1.0
    return np.where(found > 0.0, found, -((13.0 * u.sum(1)) % 1.0))


def pedestrian(u):
    """Steps off a moment too early or late, mostly without a look."""
    speed = np.clip(1.34 + 0.26 * ndtri(np.clip(u[:, 2], 1e-9, 1 - 1e-9)), 0.4, 1.4)
    late = 12.0 * u[:, 1] - 4.0 / speed - 1.0
    gap = 5.7 + 1.6 * ndtri(np.clip(u[:, 3], 1e-9, 1 - 1e-9))
    goes = (u[:, 4] < 0.073) | (12.0 * u[:, 1] >= gap)
    near = 0.03 * (1.0 + np.sin(6.0 * u[:, 0])) - np.abs(late)
    return np.where(goes, near, -20.0)


def lights(u):
    """A fifth of those who neither look nor comply fail, and very few others."""
    rare = (u[:, 4] < 0.073) & (u[:, 5] < 0.135)
    return np.where(rare, 0.2 - u[:, 0], 1e-4 - u[:, 0])


RARE = 0.073 * 0.135
FUNCTIONS = {
    "corner": Function(corner, 1e-4),
    "corners": Function(corners, 2 * 0.08**3 - 0.08**6),
    "ball": Function(ball, math.pi**3 / 6 * 0.17**6),
    "scattered": Function(scattered, 1e-3),
    "pedestrian": Function(pedestrian, math.nan, (Cut(4, 0.073),)),  # by 4 million points
    "lights": Function(lights, 0.2 * RARE + 1e-4 * (1 - RARE), (Cut(4, 0.073), Cut(5, 0.135))),
}


def main() -> None:
    """Print one row a function and method."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--episodes", type=int, default=2000)
    parser.add_argument("--replications", type=int, default=200)
    parser.add_argument("--half-width", type=float, help="at which to end early; default: never")
    parser.add_argument("--method", action="append", choices=METHODS)
    parser.add_argument("--function", action="append", choices=FUNCTIONS)
    asked = parser.parse_args()
    print("function    p        method       mean/p  rel. sd  coverage  refused  played  gain")
    for name in asked.function or FUNCTIONS:
        function = FUNCTIONS[name]
        known = function if function.p == function.p else function._replace(p=_counted(function))
        for method in asked.method or METHODS:
            goal = Goal(asked.episodes, asked.half_width or NEVER)
            print(f"{name:10}  {row(known, method, goal, asked.replications)}", flush=True)


def _counted(function: Function) -> float:
    """A probability by many points."""
    rng = np.random.default_rng(0)
    parts = [function.margin(rng.random((400_000, DIMENSION))) > 0.0 for _ in range(10)]
    return float(np.mean(parts))


def row(function: Function, method: str, goal: Goal, replications: int) -> str:
    """The row of a method; a result is estimate, lower, upper, played, or refused."""
    play = {"sobol": _sobol, "subset": _subset}.get(method) or _shipped(method, function.cuts)
    streams = [np.random.default_rng([7, i]) for i in range(replications)]
    found = [play(function.margin, goal, rng) for rng in streams]
    kept = [one for one in found if not one[4]]
    estimates, played = np.array([one[0] for one in found]), np.mean([one[3] for one in found])
    spread = estimates.std(ddof=1) / function.p
    covered = np.mean([one[1] <= function.p <= one[2] for one in kept]) if kept else math.nan
    gain = (1 - function.p) / function.p / played / spread**2 if spread else math.nan
    return (
        f"{function.p:.1e}  {method:11}  {estimates.mean() / function.p:6.2f}  {spread:7.2f}  "
        f"{covered:8.3f}  {len(found) - len(kept):7}  {played:6.0f}  {gain:4.2g}"
    )


def _shipped(method: str, cuts: tuple[Cut, ...]):
    """One of the methods of cavsumo."""

    def play(margin, goal, rng):
        one = estimator(method, DIMENSION, goal, rng, cuts)
        while not one.over:
            margins = margin(one.ask())
            one.tell([PlayedVector(bool(m > 0.0), float(m)) for m in margins])
        last = one.history[-1]
        return last.p, last.lower, last.upper, last.episodes, bool(last.refused)

    return play


def _sobol(margin, goal, rng):
    """Scrambled Sobol points, a power of two."""
    count = 2 ** int(math.log2(goal.episodes))
    failed = margin(qmc.Sobol(DIMENSION, rng=rng).random(count)) > 0.0
    half = 1.96 * failed.std() / math.sqrt(count)
    return failed.mean(), failed.mean() - half, failed.mean() + half, count, not failed.any()


def _subset(margin, goal, rng):
    """Independent runs of subset simulation and a t interval over them."""
    runs = [_one_subset(margin, goal.episodes // SUBSETS // 4, rng) for _ in range(SUBSETS)]
    values = np.array([one for one, _ in runs])
    half = t.ppf(0.975, SUBSETS - 1) * values.std(ddof=1) / math.sqrt(SUBSETS)
    mean = values.mean()
    return mean, mean - half, mean + half, sum(count for _, count in runs), not mean


def _one_subset(margin, size, rng):
    """One run: levels that a fifth passes, chains between; the estimate and its episodes."""
    z = rng.standard_normal((size, DIMENSION))
    value, played, kept = margin(ndtr(z)), size, int(KEPT * size)
    for level in range(MOST_LEVELS):
        if (value > 0.0).sum() >= kept:
            return KEPT**level * (value > 0.0).mean(), played
        best = np.argsort(-value, kind="stable")[:kept]
        z, value = _chains(margin, z[best], value[best], rng)
        played += len(z) - kept
    return KEPT**MOST_LEVELS * (value > 0.0).mean(), played


def _chains(margin, z, value, rng):
    """Chains from the best points of a level, which stay beyond its threshold."""
    threshold, keep = value.min(), 0.8
    states, values = [z], [value]
    for _ in range(round(1 / KEPT) - 1):
        moved = keep * z + math.sqrt(1.0 - keep**2) * rng.standard_normal(z.shape)
        there = margin(ndtr(moved))
        accepted = there >= threshold
        keep = min(0.99, max(0.3, keep + (0.03 if accepted.mean() < 0.3 else -0.03)))
        z, value = np.where(accepted[:, None], moved, z), np.where(accepted, there, value)
        states.append(z)
        values.append(value)
    return np.concatenate(states), np.concatenate(values)


if __name__ == "__main__":
    main()
