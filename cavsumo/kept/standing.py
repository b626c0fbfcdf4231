"""Whether an ego that stands at the end of an episode has a reason: a body ahead, or a light."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cavsumo.network.site import Site
from cavsumo.results.traces import Trace, states

NEAR_M = 15.0  # how far ahead a body is a reason
BESIDE_M = 1.5  # and how far from the ego's path its centre may be: half of both widths and little
LIGHT_M = 40.0  # how far ahead a light is a reason
STOP = frozenset("ruyY")  # SUMO's letters


def has_reason_to_stand(trace: Trace, site: Site) -> bool:
    """Whether somebody is in the ego's way in the last frame, or a light there shows no green."""
    last = trace.frames[-1]
    ego = site.route.path.project(*last["ego"][:2]).along
    front = ego + trace.shapes()["ego"].length / 2
    return _body_ahead(last, site, ego) or _light_ahead(last, site, front)


def _body_ahead(last: Mapping[str, Any], site: Site, ego: float) -> bool:
    """Whether a body is on the ego's way, near ahead of its centre."""
    for part, _, state in states(last):
        if part != "ego":
            here = site.route.path.project(state[0], state[1])
            if ego < here.along < ego + NEAR_M and abs(here.lateral) < BESIDE_M:
                return True
    return False


def _light_ahead(last: Mapping[str, Any], site: Site, front: float) -> bool:
    """Whether a light near ahead requires a stop."""
    shown = zip(site.lights, last.get("lights", ""), strict=False)
    return any(-1.0 < light.along - front < LIGHT_M and say in STOP for light, say in shown)
