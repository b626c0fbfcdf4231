"""Safe distances of Responsibility-Sensitive Safety (Shalev-Shwartz et al., arXiv 1708.06374).

All functions take numbers or arrays that broadcast: speeds [m/s], accelerations and decelerations
as positive numbers [m/s2], the response time rho [s]; they return distances [m].
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Numbers = NDArray[np.float64]


def rss_longitudinal(
    v_rear: ArrayLike,
    v_front: ArrayLike,
    rho: ArrayLike,
    a_max_accel: ArrayLike,
    b_min: ArrayLike,
    b_max: ArrayLike,
) -> Numbers:
    """Safe distance to a vehicle ahead that drives the same way (definition 1).

    The rear vehicle accelerates with ``a_max_accel`` for ``rho``, then brakes with at least
    ``b_min``, while the front one brakes with at most ``b_max``.
    """
    rear, front, response = (np.asarray(v, float) for v in (v_rear, v_front, rho))
    ahead = front**2 / (2.0 * np.asarray(b_max, float))
    return np.maximum(0.0, _stopped(rear, response, a_max_accel, b_min) - ahead)


def rss_longitudinal_opposite(
    v_ego: ArrayLike,
    v_oncoming: ArrayLike,
    rho: ArrayLike,
    a_max_accel: ArrayLike,
    b_min_correct: ArrayLike,
    b_min: ArrayLike,
) -> Numbers:
    """Safe distance to oncoming traffic (definition 2); both speeds count as positive.

    The vehicle in its own lane brakes with at least ``b_min_correct``, the other with ``b_min``.
    """
    response = np.asarray(rho, float)
    own = _stopped(np.abs(np.asarray(v_ego, float)), response, a_max_accel, b_min_correct)
    return own + _stopped(np.abs(np.asarray(v_oncoming, float)), response, a_max_accel, b_min)


def rss_lateral(
    v_left: ArrayLike,
    v_right: ArrayLike,
    rho: ArrayLike,
    a_lat_max_accel: ArrayLike,
    b_lat_min: ArrayLike,
    mu: ArrayLike,
) -> Numbers:
    """Safe distance beside a vehicle (definition 6); lateral speeds are positive to the right.

    A vehicle that still moves apart after the response time does not brake (as in ad-rss-lib,
    RssFormulas.cpp; the formula as printed would); ``mu`` is kept in any case.
    """
    response, accel = np.asarray(rho, float), np.asarray(a_lat_max_accel, float)
    left = _sideways(np.asarray(v_left, float), response, accel, b_lat_min)
    right = _sideways(-np.asarray(v_right, float), response, accel, b_lat_min)
    return np.asarray(mu, float) + np.maximum(0.0, left + right)


def _stopped(v: Numbers, rho: Numbers, accel: ArrayLike, decel: ArrayLike) -> Numbers:
    """The way of a vehicle that accelerates for rho and then brakes."""
    a = np.asarray(accel, float)
    return v * rho + a * rho**2 / 2.0 + (v + a * rho) ** 2 / (2.0 * np.asarray(decel, float))


def _sideways(v: Numbers, rho: Numbers, accel: Numbers, decel: ArrayLike) -> Numbers:
    """The way of a vehicle that accelerates towards the other for rho, then brakes."""
    after = v + rho * accel
    braking = np.where(after > 0.0, after**2 / (2.0 * np.asarray(decel, float)), 0.0)
    return (v + after) / 2.0 * rho + braking
