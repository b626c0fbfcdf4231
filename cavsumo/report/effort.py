"""The rate of tests and failures per simulated second and per second of the processes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cavsumo.report.compare import EVENTS
from cavsumo.report.grouping import Group, Told
from cavsumo.results.statistics import Interval


@dataclass(frozen=True)
class PerSecond:
    """A rate per second.

    Attributes:
        value: the rate; None without any time.
        interval: its 95 % interval; None with fewer than two episodes that have any.
    """

    value: float | None
    interval: Interval | None


@dataclass(frozen=True)
class Effort(Told):
    """The effort of a group and its yield.

    Attributes:
        simulated_s: simulated time of its valid episodes [s].
        real_s: real time of the processes that played all its episodes, errors included [s]; that
            is CPU time as long as there are no more processes than processors.
        preventable_simulated, tests_simulated, failures_simulated: per simulated second.
        preventable_real, tests_real, failures_real: per second of real time of a process.

    Preventable failures have no figures where not all were judged.
    """

    simulated_s: float
    real_s: float
    preventable_simulated: PerSecond
    tests_simulated: PerSecond
    failures_simulated: PerSecond
    preventable_real: PerSecond
    tests_real: PerSecond
    failures_real: PerSecond


def effort(group: Group) -> Effort:
    """The effort of one group."""
    valid, events = group.valid, EVENTS.items()
    simulated = valid["time_s"].to_numpy(float)
    real = group.rows["wall_s"].fillna(0.0).to_numpy(float)
    per_simulated, per_real = (
        {name: per_second(happened(rows).to_numpy(float), seconds) for name, happened in events}
        for rows, seconds in ((valid, simulated), (group.rows, real))
    )
    if not group.reference:
        per_simulated["preventable"] = per_real["preventable"] = PerSecond(None, None)
    return Effort(
        *group.whose,
        simulated_s=float(simulated.sum()),
        real_s=float(real.sum()),
        preventable_simulated=per_simulated["preventable"],
        tests_simulated=per_simulated["tests"],
        failures_simulated=per_simulated["failures"],
        preventable_real=per_real["preventable"],
        tests_real=per_real["tests"],
        failures_real=per_real["failures"],
    )


def per_second(counts: NDArray[np.float64], seconds: NDArray[np.float64]) -> PerSecond:
    """Events over time, episode by episode, as a ratio estimate.

    The interval is normal on the logarithm, with the variance of a ratio of means over independent
    episodes (Cochran 1977, Sampling Techniques, section 6.3): counts and lengths may depend on
    each other, as they do, because an episode ends with its test.
    """
    total, time, n = float(counts.sum()), float(seconds.sum()), len(counts)
    if time <= 0.0:
        return PerSecond(None, None)
    value = total / time
    if total < 2.0:
        return PerSecond(value, None)
    residuals = counts - value * seconds
    spread = math.sqrt(float((residuals**2).sum()) * n / (n - 1)) / total
    factor = math.exp(1.959963984540054 * spread)
    return PerSecond(value, (value / factor, value * factor))
