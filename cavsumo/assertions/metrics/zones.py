"""CAV-Gym's stopping zones as a metric of one moment (see ``geometry`` for the zones)."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

from cavsumo.model.geometry import Box, overlap
from cavsumo.model.stopping_zones import stopping_distances

INTERESTING, UNINTERESTING, NONE = "interesting", "uninteresting_terminated", "not_triggered"


def cavgym_zones(
    ego_speed: float,
    max_decel: float,
    reaction_time: float,
    ego_length: float,
    ego_width: float,
    steering: float,
    ped_centre_ego_frame: Sequence[float],
    ped_length: float,
    ped_width: float,
    ped_heading_ego_frame: float,
) -> dict[str, Any]:
    """CAV-Gym's verdict on a pedestrian at one moment (github.com/TSL-UOB/CAV-Gym, bodies.py).

    As there, an ego that stands or steers has no zones; the assertion ``reaction-zone`` bends them.

    Args:
        ego_speed: [m/s]; max_decel: [m/s2]; reaction_time: [s]; lengths and widths: [m].
        ped_centre_ego_frame: x ahead of and y left of the ego's centre [m].
        ped_heading_ego_frame: relative to the ego's heading [rad].

    Returns ``braking_m, reaction_m`` (the zones' lengths), ``braking_interval,
    reaction_interval`` (x in the ego's frame, None without zones) and ``verdict``: interesting (a
    pedestrian touches the reaction zone), uninteresting_terminated (the ego or its braking zone,
    which is checked first) or not_triggered.
    """
    braking, reaction = stopping_distances(
        ego_speed, max_decel=max_decel, reaction_time=reaction_time
    )
    x, y = ped_centre_ego_frame
    pedestrian = Box(x, y, ped_heading_ego_frame, ped_length, ped_width)
    front = ego_length / 2.0
    ends = [front, front + braking, front + braking + reaction]
    zones = ego_speed > 0.0 and steering == 0.0
    touched = [overlap(Box(0.0, 0.0, 0.0, ego_length, ego_width), pedestrian)]
    if zones:
        touched += [
            _touches(pedestrian, begin, end, ego_width) for begin, end in itertools.pairwise(ends)
        ]
    verdict = UNINTERESTING if any(touched[:2]) else INTERESTING if any(touched) else NONE
    return {
        "braking_m": braking,
        "reaction_m": reaction,
        "braking_interval": ends[:2] if zones else None,
        "reaction_interval": ends[1:] if zones else None,
        "verdict": verdict,
    }


def _touches(body: Box, begin: float, end: float, width: float) -> bool:
    """Whether a body touches the strip between two distances ahead."""
    return overlap(Box((begin + end) / 2.0, 0.0, 0.0, end - begin, width), body)
