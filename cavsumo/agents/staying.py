"""Keeping pedestrians with arbitrary actions on the pavements until they step onto a carriageway.

A tester that draws its actions at random, or has not yet learned their effects, would walk through
gardens and houses, which networks do not contain. Until its body has stepped out it takes an action
only if, stopping after it, the body would still be on a pavement, walking area, crossing or lane;
else it turns to walk along the axis of its pavement.
"""

from __future__ import annotations

import math

import shapely

from cavsumo.agents.walking import walk
from cavsumo.model.bodies import Action
from cavsumo.model.kinematics import step_floats
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState
from cavsumo.model.stopping_way import stopping_way

ONWARD_M = 3.0  # it walks to a point of the axis so far ahead
END_M = 0.5  # and no nearer to its ends than this


class Staying:
    """Keeps one body on the pavements until it has stepped out, in one episode.

    It may go anywhere on an open plane, with ``jaywalk``, and if it starts on no pavement.
    """

    def __init__(self, scene: Scene, index: int) -> None:
        start = scene.starts[index]
        self.scene, self.pavement, self.ground = scene, start.pavement, scene.ground
        self.free = self.ground is None or not shapely.contains_xy(self.ground, start.x, start.y)
        self.onward = 1.0 if start.forwards else -1.0

    def action(self, state: BodyState, wanted: Action) -> Action:
        """The wanted action, or a turn along the pavement if that leads off the ground."""
        roads, pavement = self.scene.roads, self.pavement
        self.free = self.free or roads is None or roads.contains(state.x, state.y)
        if self.free or pavement is None:
            return wanted
        kind, dt = state.body.kind, self.scene.dt
        limits = kind.wheelbase, kind.v_min, kind.v_max, dt
        x, y, v, o = step_floats(*state[1:], *wanted, *limits)
        way = stopping_way(kind, v, dt)
        if shapely.contains_xy(self.ground, x + way * math.cos(o), y + way * math.sin(o)):
            return wanted
        along = pavement.project(state.x, state.y).along
        last = max(END_M, pavement.length - END_M)
        there = along + ONWARD_M * self.onward
        if not END_M <= there <= last:  # back from its end
            self.onward = -self.onward
            there = min(last, max(END_M, along + ONWARD_M * self.onward))
        to_x, to_y, _ = pavement.at(there)
        heading = math.atan2(to_y - state.y, to_x - state.x)
        return walk(state, heading, kind.v_max, dt)
