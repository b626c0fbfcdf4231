"""A scripted test without SUMO: where an ego that keeps its speed first meets somebody.

Bodies are where their programmes have them; nobody reacts. Scripts of published scenarios get the
place of the nominal contact from it, as suites have it from their protocols.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from cavsumo.agents.story_conditions import BoardView
from cavsumo.agents.storyboard import StoryRun
from cavsumo.model.bodies import CAR, Body
from cavsumo.model.geometry import gap
from cavsumo.model.scenario.script import ScriptedTest
from cavsumo.model.scenario.storyboard import EGO
from cavsumo.model.snapshot import BodyState

STEP_S = 0.02


def nominal_contact(script: ScriptedTest, until: float) -> float:
    """How far the ego has gone at the first contact, or where it comes nearest to somebody [m].

    Args:
        script: with a storyboard, and the ego's box.
        until: end of the search [s].
    """
    story, nearest, where = StoryRun(script, STEP_S), math.inf, 0.0
    for step in range(int(until / STEP_S)):
        view = view_of(script, story, step * STEP_S)
        story.advance(view)
        ego = view.states[EGO].box
        apart = min(gap(ego, state.box) for name, state in view.states.items() if name != EGO)
        if apart < nearest:
            nearest, where = apart, script.ego.speed_mps * view.time
        if apart <= 0.0 or story.stopped:
            break
    return where


def view_of(script: ScriptedTest, story: StoryRun, time: float) -> BoardView:
    """All bodies at a time."""
    approach, v = script.ego, script.ego.speed_mps
    assert approach.length_m is not None
    front = approach.start_m + v * time
    axle = approach.axle(approach.length_m)
    x, y, o = approach.way.curve.at(front - axle)
    ahead = axle - approach.length_m / 2
    kind = _boxed(approach.length_m, approach.width_m or CAR.width)
    ego = BodyState(kind, x + ahead * math.cos(o), y + ahead * math.sin(o), v, o)
    states: Mapping[str, BodyState] = {EGO: ego} | {
        body.id: BodyState(own, *pose[:2], speed, pose[2])
        for own, body in zip(script.bodies, story.bodies, strict=True)
        for pose, speed in (body.pose(time),)
    }
    gone = {EGO: v * time} | {body.id: body.along(time)[0] for body in story.bodies}
    return BoardView(time, front, v, states, gone, story.board.axles_m)


def _boxed(length: float, width: float) -> Body:
    """A body of the ego's box."""
    return Body(EGO, replace(CAR, length=length, width=width))
