"""The estimators by the names under which they are chosen."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from cavsumo.probability.automatic import Automatic
from cavsumo.probability.importance import ImportanceSampling
from cavsumo.probability.monte_carlo import MonteCarlo
from cavsumo.probability.protocol import Estimator, Goal

ESTIMATORS: Mapping[str, Callable[[int, Goal, np.random.Generator], Estimator]] = {
    "auto": Automatic,
    "monte-carlo": MonteCarlo,
    "importance": ImportanceSampling,
}
