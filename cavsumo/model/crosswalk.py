"""The crosswalk of adaptive stress testing: a car, a pedestrian, and disturbances of both.

Source: Koren, Alsaif, Lee, Kochenderfer, Adaptive Stress Testing for Autonomous Vehicles, IV 2018
(arXiv 1902.01909), with the numbers of their public toolbox (sisl/AdaptiveStressTestingToolbox,
MIT, ``ToyAVSimulator``). The car drives along x; the pedestrian walks across. In each timestep of
0.1 s, with the disturbances (ax, ay, ex, ey)::

    p' = p + (w + (ax, ay) dt / 2) dt,   w' = w + (ax, ay) dt,   each part of w within 4.5 m/s
    x' = x + v dt,   v' = v + b dt        (b: the acceleration that the car chose before)
    z = p' + (ex, ey)                     (what the car measures)

The car estimates the pedestrian's place q and velocity u by an alpha-beta filter, and drives by a
variant of the Intelligent Driver Model with the pedestrian as leader while q is on the road::

    q' = q + u dt + 0.85 (z - q - u dt),   u' = u + 0.005 / dt (z - q - u dt)
    s* = s0 + v T - v (u_x - v) / (2 sqrt(a c)),   s = q_x - x
    b = a (1 - (v / v0)^4 - (s* / s)^2) on the road, else v0 - v;   b within -9 and 3 m/s2

It fails when the car, faster than 0.5 m/s, is within 2.5 m along x and 1.4 m along y of the
pedestrian. An episode is a function of one vector of independent standard normal numbers, STEPS by
``len(DEVIATIONS)``. The toolbox has errors of the measured velocity too, which its filter ignores.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

DT_S, STEPS = 0.1, 50
# Standard deviations of ax, ay [m/s2], ex, ey [m]: the toolbox has their squares.
DEVIATIONS = (math.sqrt(0.1), 0.1, math.sqrt(0.1), math.sqrt(0.1))
FASTEST_MPS = 4.5  # of the pedestrian
DESIRED_MPS, HEADWAY_S, STANDSTILL_M = 11.17, 1.5, 4.0  # v0, T, s0
ACCEL_MPS2, COMFORT_MPS2, BRAKE_MPS2 = 3.0, 2.0, 9.0  # a, c
ROAD_M = (-1.5, 4.5)  # across, from the middle of the car's lane
ALPHA, BETA = 0.85, 0.005
ZONE_M, MOVING_MPS = (2.5, 1.4), 0.5

Array = np.ndarray[Any, Any]


class CrosswalkStart(NamedTuple):
    """A starting point: the pedestrian's place and speed across, the car's place and speed."""

    y_m: float
    walk_mps: float
    x_m: float = 0.0
    car_m: float = -35.0
    car_mps: float = DESIRED_MPS


STARTS = (CrosswalkStart(-4.0, 1.0), CrosswalkStart(-5.0, 1.0), CrosswalkStart(-4.0, 1.4))


def normals(draw: int, count: int = 1) -> Array:
    """The standard normal numbers of ``count`` episodes, by the number of a draw."""
    return np.random.default_rng(draw).standard_normal((count, STEPS, len(DEVIATIONS)))


def filtered(place: Array, velocity: Array, measured: Array) -> tuple[Array, Array]:
    """The estimates after a measurement; arrays of shape (..., 2) [m, m/s]."""
    expected = place + DT_S * velocity
    wrong = measured - expected
    return expected + ALPHA * wrong, velocity + BETA / DT_S * wrong


def chosen_acceleration(v: Array, gap: Array, across: Array, along_mps: Array) -> Array:
    """The car's acceleration [m/s2].

    Args:
        v: its speed [m/s].
        gap, across, along_mps: the estimated place of the pedestrian ahead of it and beside the
            middle of its lane, and its estimated speed along the road [m, m, m/s].
    """
    on_road = (across > ROAD_M[0]) & (across < ROAD_M[1])
    away = np.copysign(np.maximum(np.abs(gap), 1e-6), gap)
    approach = v * (along_mps - v) / (2.0 * math.sqrt(ACCEL_MPS2 * COMFORT_MPS2))
    wanted = STANDSTILL_M + v * HEADWAY_S - approach
    follow = ACCEL_MPS2 * (1.0 - (v / DESIRED_MPS) ** 4 - (wanted / away) ** 2)
    return np.clip(np.where(on_road, follow, DESIRED_MPS - v), -BRAKE_MPS2, ACCEL_MPS2)


def pushed(place: Array, velocity: Array, push: Array) -> tuple[Array, Array]:
    """The pedestrian a timestep later, with an acceleration; all (..., 2)."""
    place = place + DT_S * (velocity + 0.5 * DT_S * push)
    return place, np.clip(velocity + DT_S * push, -FASTEST_MPS, FASTEST_MPS)


def struck(place: Array, x: Array, v: Array) -> Array:
    """Whether a car at x with a speed fails at a pedestrian's place (..., 2)."""
    near = (np.abs(place[..., 0] - x) <= ZONE_M[0]) & (np.abs(place[..., 1]) <= ZONE_M[1])
    found: Array = near & (v > MOVING_MPS)
    return found


def walked(start: CrosswalkStart, pushes: Array) -> Array:
    """The pedestrian's places at all timesteps, (..., STEPS + 1, 2) [m].

    ``pushes``: its accelerations, (..., STEPS, 2) [m/s2].
    """
    place = np.broadcast_to([start.x_m, start.y_m], (*pushes.shape[:-2], 2)).astype(float)
    velocity = np.broadcast_to([0.0, start.walk_mps], place.shape).astype(float)
    places = [place]
    for k in range(pushes.shape[-2]):
        place, velocity = pushed(place, velocity, pushes[..., k, :])
        places.append(place)
    return np.stack(places, axis=-2)


def failures(start: CrosswalkStart, numbers: Array) -> Array:
    """Whether each episode fails, (n,).

    ``numbers``: independent standard normal ones, (n, STEPS, 4).
    """
    scaled = numbers * np.array(DEVIATIONS)
    places, errors = walked(start, scaled[..., :2]), scaled[..., 2:]
    place, velocity = places[:, 0], np.broadcast_to([0.0, start.walk_mps], places[:, 0].shape)
    x, v = np.full(len(numbers), start.car_m), np.full(len(numbers), start.car_mps)
    chosen, failed = np.zeros(len(numbers)), np.zeros(len(numbers), dtype=bool)
    for k in range(STEPS):
        x, v = x + DT_S * v, v + DT_S * chosen
        here = places[:, k + 1]
        failed |= struck(here, x, v)
        place, velocity = filtered(place, velocity, here + errors[:, k])
        chosen = chosen_acceleration(v, place[:, 0] - x, place[:, 1], velocity[:, 0])
    return failed
