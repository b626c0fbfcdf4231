"""One vehicle behind another on a line: time to collision and deceleration to avoid it.

All functions take numbers or arrays that broadcast and return arrays of the common shape. Gaps are
from the follower's front to the leader's rear [m], speeds [m/s], accelerations [m/s2], times [s].
If a follower does not close in, times are infinite and decelerations 0. Values too large for a
float are infinite.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Numbers = NDArray[np.float64]


def ttc_following(gap: ArrayLike, v_follow: ArrayLike, v_lead: ArrayLike) -> Numbers:
    """Time to collision at constant speeds, gap / (v_follow - v_lead) (Hayward 1972) [s]."""
    distance, closing = _closing(gap, v_follow, v_lead)
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        time = np.where(closing > 0.0, distance / closing, np.inf)
    return np.where(distance <= 0.0, 0.0, time)


def mttc(
    gap: ArrayLike,
    v_follow: ArrayLike,
    v_lead: ArrayLike,
    a_follow: ArrayLike,
    a_lead: ArrayLike,
) -> Numbers:
    """Modified time to collision, at constant accelerations (Ozbay et al. 2008) [s].

    The smallest positive root of (a_follow - a_lead) t^2 / 2 + (v_follow - v_lead) t - gap = 0.
    Speeds may become negative.
    """
    distance, closing = _closing(gap, v_follow, v_lead)
    change = np.asarray(a_follow, float) - np.asarray(a_lead, float)
    distance, closing, change = np.broadcast_arrays(distance, closing, change)
    root = closing**2 + 2.0 * change * distance
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        # 2 D / (dv + sqrt(...)) is the root met first, without cancellation and for da = 0 too.
        first = 2.0 * distance / (closing + np.sqrt(root))
    met = (root >= 0.0) & (closing + np.sqrt(np.maximum(root, 0.0)) > 0.0)
    return np.where(distance <= 0.0, 0.0, np.where(met, first, np.inf))


def drac(gap: ArrayLike, v_follow: ArrayLike, v_lead: ArrayLike) -> Numbers:
    """Deceleration to avoid a crash, (v_follow - v_lead)^2 / (2 gap) (Guido et al. 2011) [m/s2]."""
    distance, closing = _closing(gap, v_follow, v_lead)
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        needed = np.where(distance > 0.0, closing**2 / (2.0 * distance), np.inf)
    return np.where(closing > 0.0, needed, 0.0)


def mdrac(
    gap: ArrayLike, v_follow: ArrayLike, v_lead: ArrayLike, reaction_time: ArrayLike
) -> Numbers:
    """Deceleration to avoid a crash after a reaction time: dv / (2 (TTC - reaction_time)) [m/s2].

    Infinite when the crash comes before the reaction (Fu and Sayed 2021).
    """
    _, closing = _closing(gap, v_follow, v_lead)
    left = ttc_following(gap, v_follow, v_lead) - np.asarray(reaction_time, float)
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        needed = np.where(left > 0.0, closing / (2.0 * left), np.inf)
    return np.where(closing > 0.0, needed, 0.0)


def _closing(gap: ArrayLike, v_follow: ArrayLike, v_lead: ArrayLike) -> tuple[Numbers, Numbers]:
    """The gap and the closing speed, of one shape."""
    distance, follow, lead = np.broadcast_arrays(
        np.asarray(gap, float), np.asarray(v_follow, float), np.asarray(v_lead, float)
    )
    return distance, follow - lead
