"""The estimators by the names under which they are chosen."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from cavsumo.errors import InputError
from cavsumo.probability.automatic import automatic
from cavsumo.probability.importance import ImportanceSampling
from cavsumo.probability.monte_carlo import MonteCarlo
from cavsumo.probability.protocol import FEWEST_EPISODES, Estimator, Goal
from cavsumo.probability.stratified import Cut, Stratified

PLAIN, STRATIFIED = "monte-carlo", "stratified"
ESTIMATORS: Mapping[str, Callable[[int, Goal, np.random.Generator], Estimator]] = {
    "auto": automatic,
    PLAIN: MonteCarlo,
    STRATIFIED: Stratified,
    "importance": ImportanceSampling,
}


def estimator(
    method: str, dimension: int, goal: Goal, rng: np.random.Generator, cuts: Sequence[Cut] = ()
) -> Estimator:
    """The estimator of a name; ``cuts``: the shares at which encounters change their kind."""
    if method == STRATIFIED:
        return Stratified(dimension, goal, rng, cuts)
    return ESTIMATORS[method](dimension, goal, rng)


def check_episodes(method: str, episodes: int) -> None:
    """Raise InputError where an estimator needs more episodes."""
    if method == "importance" and episodes < FEWEST_EPISODES:
        raise InputError(
            f"method {method}: expected at least {FEWEST_EPISODES} episodes, got {episodes}; "
            f"{PLAIN} takes any number"
        )
