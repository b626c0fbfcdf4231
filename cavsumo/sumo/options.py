"""The options with which SUMO always runs; its defaults are made for traffic studies, not tests."""

from __future__ import annotations

from collections.abc import Mapping

OPTIONS: Mapping[str, str] = {
    "collision.action": "warn",  # the default, teleport, hides collisions of moved vehicles
    "collision.check-junctions": "true",
    "collision.mingap-factor": "0",  # physical contact only
    "time-to-teleport": "-1",  # a standing body must not jump
    "pedestrian.model": "striping",  # the others ignore moved persons, or hang
    # An ego with an actionStepLength silently makes SUMO integrate all traffic ballistically;
    # always doing so lets different egos meet the same traffic.
    "step-method.ballistic": "true",
    "precision": "6",
    "no-step-log": "true",
    "no-warnings": "true",
    "duration-log.disable": "true",
}
