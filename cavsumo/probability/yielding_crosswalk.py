"""The crosswalk on which SPAIS was published: a car that yields, and a pedestrian with noise.

Source: Delecki, Katz, Kochenderfer, Failure Probability Estimation for Black-Box Autonomous Systems
using State-Dependent Importance Sampling Proposals (arXiv 2412.02154), with the numbers of their
public code (sisl/SPAIS.jl, examples/crosswalk.jl) and of the packages that it runs on
(sisl/AdversarialDriving.jl, sisl/AutomotiveSimulator.jl; all MIT). The published reference is
5.9e-5.

The car (4 x 1.8 m) drives along x at y = 0, the pedestrian (1 x 1 m) along a crosswalk 6 m wide at
x = 25: s is its place along it (y = s - 10), t its place to the left (x = 25 - t). A step takes
0.2 s. With five normal numbers n of standard deviation 0.25::

    pedestrian   s' = s + vs dt + as dt2 / 2,  vs' = vs + as dt,   as = clip(1 - w, -9, 3) + n1
                 t' = t + vt dt + n2 dt2 / 2,  vt' = vt + n2 dt,   w = |(vs, vt)|, at most 3 m/s
    car          x' = x + v dt + a dt2 / 2,    v' = max(0, v + a dt)
    seen         s + n3, t + n4, w + n5

The car follows the Intelligent Driver Model (``following_acceleration``). It stops before the
crosswalk (22 to 28 m) unless that is clear by constant speed of the pedestrian: it has left, or
enters after the car is through, or left 7 s before. It fails when their boxes overlap while it is
faster than 0.1 m/s. A run ends at an overlap, at x > 35 or at s > 13.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cavsumo.probability.noisy import ENDED, FAILED, RUNNING
from cavsumo.probability.tree import Bools, Floats

DT_S, DEVIATION = 0.2, 0.25
CROSSWALK_X_M, ENTRY_X_M, EXIT_X_M = 25.0, 22.0, 28.0
FIRST_Y_M = -10.0  # of the crosswalk
ENTRY_S_M, EXIT_S_M, LANE_HALF_M = 8.5, 14.5, 1.5
LAST_X_M, LAST_S_M = 35.0, 13.0
CAR_M, BODY_M = (4.0, 1.8), 1.0
FASTEST_MPS, MOVING_MPS = 3.0, 0.1
WALK_MPS, DESIRED_MPS = 1.0, 10.0
STANDSTILL_M, HEADWAY_S, ACCEL_MPS2, COMFORT_MPS2, BRAKE_MPS2 = 5.0, 1.5, 3.0, 2.0, 9.0
CLEARED_S, ABOUT_TO_M = 7.0, 2.0  # time after somebody left; so near means in the intersection


@dataclass(frozen=True)
class YieldingCrosswalk:
    """The process; a state is s, t, vs, vt, x, v and whether it runs."""

    horizon: int = 100
    numbers: int = 5
    s_m: float = 5.0
    walk_mps: float = 1.5
    car_mps: float = 8.0

    def begin(self, count: int) -> Floats:
        """First states."""
        first = [self.s_m, 0.0, self.walk_mps, 0.0, 0.0, self.car_mps, RUNNING]
        return np.tile(np.array(first), (count, 1))

    def moved(self, states: Floats, drawn: Floats) -> Floats:
        """The states after a step."""
        s, t, vs, vt, x, v, _ = states.T
        n = DEVIATION * drawn.T
        walk = np.hypot(vs, vt)
        along = np.clip(WALK_MPS - walk, -BRAKE_MPS2, ACCEL_MPS2) + n[0]
        chosen = chosen_acceleration(x, v, s + n[2], t + n[3], walk + n[4])
        s = np.maximum(0.0, s + vs * DT_S + 0.5 * along * DT_S**2)
        t = t + vt * DT_S + 0.5 * n[1] * DT_S**2
        vs, vt = vs + along * DT_S, vt + n[1] * DT_S
        slower = np.minimum(1.0, FASTEST_MPS / np.maximum(np.hypot(vs, vt), 1e-12))
        x = x + v * DT_S + 0.5 * chosen * DT_S**2
        v = np.maximum(0.0, v + chosen * DT_S)
        now = np.stack([s, t, vs * slower, vt * slower, x, v, np.zeros(len(s))], axis=1)
        touching = overlapping(now)
        over = touching | (x > LAST_X_M) | (s > LAST_S_M)
        now[:, -1] = np.where(touching & (v > MOVING_MPS), FAILED, np.where(over, ENDED, RUNNING))
        return now

    def features(self, states: Floats) -> Floats:
        """Places and speeds, scaled."""
        s, t, vs, vt, x, v, _ = states.T
        return np.stack(
            [(s - 9.0) / 4.0, t, vs - 1.0, vt, (x - 17.0) / 10.0, (v - 5.0) / 5.0], axis=1
        )


def chosen_acceleration(x: Floats, v: Floats, s: Floats, t: Floats, walk: Floats) -> Floats:
    """The car's acceleration [m/s2].

    Args:
        x, v: its place and speed.
        s, t, walk: where it sees the pedestrian on the crosswalk, and how fast; the speed may be
            negative by noise.
    """
    gap = (CROSSWALK_X_M - t) - BODY_M / 2 - x - CAR_M[0] / 2
    in_lane = (np.abs(s + FIRST_Y_M) <= LANE_HALF_M) & (gap > 0.0)
    ahead = np.where(in_lane, gap, np.inf)
    free = np.clip(DESIRED_MPS - v, -BRAKE_MPS2, ACCEL_MPS2)
    usual = np.where(in_lane, following_acceleration(v, walk, ahead), free)
    line, through = ENTRY_X_M - x, EXIT_X_M - x
    waits = (through > 0.0) & ~_clear(v, through, s, walk, ahead)
    waits &= ~in_lane | ((line > 0.0) & (line < ahead))
    yielding = following_acceleration(v, np.zeros_like(v), np.minimum(ahead, line))
    return np.where(waits, yielding, usual)


def following_acceleration(v: Floats, other: Floats, gap: Floats) -> Floats:
    """The Intelligent Driver Model behind something with a speed at a gap [m/s2]."""
    approach = v * (v - other) / (2.0 * math.sqrt(ACCEL_MPS2 * COMFORT_MPS2))
    wanted = STANDSTILL_M + v * HEADWAY_S + approach
    with np.errstate(divide="ignore"):
        found = ACCEL_MPS2 * (1.0 - (v / DESIRED_MPS) ** 4 - (wanted / gap) ** 2)
    return np.where(gap < 0.0, -BRAKE_MPS2, np.clip(found, -BRAKE_MPS2, ACCEL_MPS2))


def _clear(v: Floats, through: Floats, s: Floats, walk: Floats, ahead: Floats) -> Bools:
    """Whether the crosswalk will be clear, as the car holds it to be."""
    squared = v * v + 2.0 * ACCEL_MPS2 * through
    fastest = np.minimum(DESIRED_MPS, np.sqrt(np.maximum(squared, 0.0)))
    own = np.where(squared < 0.0, 0.0, 2.0 * through / (fastest + v))
    with np.errstate(divide="ignore", invalid="ignore"):
        enters, leaves = (ENTRY_S_M - s) / walk, (EXIT_S_M - s) / walk
        free = (leaves <= 0.0) | (enters > own) | (leaves + CLEARED_S < own)
    inside = (ENTRY_S_M - s < ABOUT_TO_M) & (EXIT_S_M - s > 0.0)
    return free & ~inside & (ahead > through)


def overlapping(states: Floats) -> Bools:
    """Whether the boxes overlap; the pedestrian's is turned into its direction of walking."""
    s, t, vs, vt, x = states.T[:5]
    dx, dy = CROSSWALK_X_M - t - x, s + FIRST_Y_M
    speed = np.hypot(vs, vt)
    still = speed == 0.0
    cos = np.where(still, 1.0, vs / np.where(still, 1.0, speed))
    sin = np.where(still, 0.0, vt / np.where(still, 1.0, speed))
    half = BODY_M / 2 * (np.abs(cos) + np.abs(sin))
    apart = (np.abs(dx) > CAR_M[0] / 2 + half) | (np.abs(dy) > CAR_M[1] / 2 + half)
    # The axes of the pedestrian's box: along (-sin, cos) and across (cos, sin).
    for ax, ay in ((-sin, cos), (cos, sin)):
        reach = CAR_M[0] / 2 * np.abs(ax) + CAR_M[1] / 2 * np.abs(ay)
        apart |= np.abs(dx * ax + dy * ay) > BODY_M / 2 + reach
    found: Bools = ~apart
    return found
