"""How long until the first test: within an episode, with censoring, and across the batch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas
from numpy.typing import NDArray

from cavsumo.report.compare import EVENTS
from cavsumo.report.grouping import Group, Told
from cavsumo.results.kaplan_meier import (
    Curve,
    kaplan_meier,
    median_time_to_test,
    restricted_mean,
)
from cavsumo.results.statistics import Interval


class RunOf(NamedTuple):
    """An episode by its results file and its number there, as ``cavsumo replay`` takes them."""

    file: str
    run: int


@dataclass(frozen=True)
class TimeToTest(Told):
    """The times of tests.

    Attributes:
        tests, censored: numbers of episodes with and without a test.
        median: the time by which half of the episodes would have had a test [s]; None when fewer
            have one before the last is censored.
        median_interval: its 95 % interval [s], where the curve's interval crosses one half
            (Brookmeyer and Crowley 1982, Biometrics 38, 29); the end may be infinite.
        mean, mean_interval: the mean time without a test up to the limit [s], normal interval; no
            interval without any test before the limit.
        limit: the time up to which the mean is taken [s], one for all groups.
        first_preventable, first_test, first_failure: the first such run; None for none.
        curve: the whole estimate; None without episodes.
    """

    tests: int
    censored: int
    median: float | None
    median_interval: Interval | None
    mean: float | None
    mean_interval: Interval | None
    limit: float | None
    first_preventable: RunOf | None
    first_test: RunOf | None
    first_failure: RunOf | None
    curve: Curve | None


def times_to_test(groups: Sequence[Group]) -> list[TimeToTest]:
    """One estimate per group, with a common limit for the means."""
    curves = [kaplan_meier(*times_and_events(group.valid)) for group in groups]
    limit = min((float(curve.times[-1]) for curve in curves if curve is not None), default=None)
    return [_estimate(group, curve, limit) for group, curve in zip(groups, curves, strict=True)]


def times_and_events(valid: pandas.DataFrame) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """For each episode the time of its test, or of its end, and whether it was a test."""
    tests = EVENTS["tests"](valid)
    times = valid["trigger_time_s"].where(tests, valid["time_s"])
    return times.to_numpy(float), tests.to_numpy(bool)


def _estimate(group: Group, curve: Curve | None, limit: float | None) -> TimeToTest:
    """The estimate of one group."""
    valid = group.valid
    tests = int(EVENTS["tests"](valid).sum())
    middle, around = median_time_to_test(curve) if curve is not None else (None, None)
    mean, near = (None, None)
    if curve is not None and limit is not None:
        mean, near = restricted_mean(curve, limit)
    return TimeToTest(
        *group.whose,
        tests=tests,
        censored=len(valid) - tests,
        median=middle,
        median_interval=around,
        mean=mean,
        mean_interval=near,
        limit=limit,
        first_preventable=_first(valid, "preventable"),
        first_test=_first(valid, "tests"),
        first_failure=_first(valid, "failures"),
        curve=curve,
    )


def _first(valid: pandas.DataFrame, event: str) -> RunOf | None:
    """The first episode in which it happened."""
    found = valid[EVENTS[event](valid)]
    return RunOf(found["file"].iloc[0], int(found["run"].iloc[0])) if len(found) else None
