"""Programmed testers that follow a script: each along its way, and each commits once.

The place of a body is a function of time (``model.motion``). The kinematics moves a body by its old
speed, so the speed for a timestep is the mean over the timestep after it::

    v(t + dt) = (s(t + 2 dt) - s(t + dt)) / dt

and the body is at s(t) exactly at every timestep. Before its programme begins it stands or keeps
its speed. When it has to begin is computed from the ego's place and speed until that moment; then
it is fixed. A body with a track is where the track has it, from the ego's entry on. A storyboard
moves the bodies that have neither (``agents.storyboard``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from cavsumo.agents.base import AGENTS, Agent
from cavsumo.agents.story_body import StoryBody
from cavsumo.agents.story_conditions import BoardView
from cavsumo.agents.storyboard import StoryRun
from cavsumo.errors import AgentError, EgoError
from cavsumo.model.bodies import Action
from cavsumo.model.curve import PlaneCurve
from cavsumo.model.kinematics import step_floats, wrap
from cavsumo.model.motion import Motion
from cavsumo.model.scenario.script import Begins, Programme, ScriptedTest
from cavsumo.model.scenario.storyboard import EGO
from cavsumo.model.scenario.track import Place, ScriptedTrack
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

HOLDS_S = 0.5  # an ego that keeps the speed with which it entered for so long holds it
LATE_S = 0.1  # a body that cannot begin in time by more than that would miss its point
ROUNDS = 4  # of Newton's method for a steering angle; it converges in two or three


@AGENTS.register("scripted")
class ScriptedAgent(Agent):
    """Moves the programmed testers of a suite or a script; without one it does nothing."""

    sees_background = False

    def reset(self, scene: Scene, owned: Sequence[int], rng: np.random.Generator) -> None:
        super().reset(scene, owned, rng)
        self._script, self._checked = scene.script, False
        self._story: StoryRun | None = None
        if scene.script is not None:
            testers, begins = scene.script.testers, scene.script.commitments
            self._followers = [_follower(testers[i], begins[i], scene.dt) for i in owned]
            if scene.script.board is not None:
                self._story = StoryRun(scene.script, scene.dt)
                self._followers = [
                    StoryFollower(self._story.bodies[i], scene.dt) if _free(testers[i]) else one
                    for i, one in zip(owned, self._followers, strict=True)
                ]

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        if self._script is None:
            return super().choose_action(snapshot)
        front, v = front_of_ego(self._script, self.scene, snapshot), snapshot.ego.v
        if not self._checked and snapshot.time >= HOLDS_S - 1e-9:
            self._checked = True
            check_approach(self._script, v)
        if self._story is not None:
            self._story.advance(seen_in(self._story, self._script, snapshot, front))
        return tuple(
            follower.action(snapshot.testers[i], snapshot.time, front, v)
            for i, follower in zip(self.owned, self._followers, strict=True)
        )

    def stops(self) -> bool:
        return self._story is not None and self._story.stopped


def seen_in(story: StoryRun, script: ScriptedTest, snapshot: Snapshot, front: float) -> BoardView:
    """The state of a timestep for the conditions of a storyboard."""
    ego, testers = snapshot.ego, snapshot.testers
    states = {EGO: ego} | {f"tester{i}": state for i, state in enumerate(testers)}
    gone = {body.id: body.along(snapshot.time)[0] for body in story.bodies}
    gone[EGO] = front - script.ego.start_m
    return BoardView(snapshot.time, front, ego.v, states, gone, story.board.axles_m)


def check_approach(script: ScriptedTest, v: float) -> None:
    """Raise EgoError unless an ego that has just entered keeps the speed of the test [m/s]."""
    wanted, name = script.ego.speed_mps, script.name or "the script"
    if abs(v - wanted) > script.ego.tolerance_mps:
        raise EgoError(
            f"the ego drives {v * 3.6:.1f} km/h {HOLDS_S:g} s after it entered with the speed of "
            f"{name}, {wanted * 3.6:.1f} km/h: it does not hold it, and nothing was tested"
        )


def front_of_ego(script: ScriptedTest, scene: Scene, snapshot: Snapshot) -> float:
    """Arc length of the ego's front on its way, as scripts count it [m]."""
    approach, ego = script.ego, snapshot.ego
    half = ego.body.kind.length / 2
    axle = approach.axle(ego.body.kind.length)
    back = axle - half  # of the point that follows the way, from the centre
    x, y = ego.x - back * math.cos(ego.o), ego.y - back * math.sin(ego.o)
    along = scene.ego_path.project(x, y).along
    if along == 0.0:  # the path begins at the ego's centre, and an axle is behind that
        x0, y0, o = scene.ego_path.at(0.0)
        along = (x - x0) * math.cos(o) + (y - y0) * math.sin(o)
    return approach.start_m - half + along + axle


@dataclass
class Follower:
    """One body in one episode.

    Attributes:
        programme: what it does.
        begins: when its stages begin; None for never.
        dt: length of a timestep [s].
        begun: when its programme began [s]; infinite before.
        ahead: distance on its way at that moment [m].
    """

    programme: Programme
    begins: Begins | None
    dt: float
    begun: float = math.inf
    ahead: float = 0.0
    curve: PlaneCurve = field(init=False)
    motion: Motion = field(init=False)

    def __post_init__(self) -> None:
        self.curve, self.motion = self.programme.way.curve, self.programme.motion

    def along(self, time: float) -> float:
        """Distance on its way at a time [m]."""
        if time <= self.begun:
            return self.programme.speed_mps * time
        return self.ahead + self.motion.at(time - self.begun)[0]

    def action(self, state: BodyState, time: float, front: float, v: float) -> Action:
        """The action of a timestep; ``front`` and ``v``: the ego's place and speed."""
        begins, dt = self.begins, self.dt
        if begins is not None and self.begun == math.inf:
            self._commit(begins, time, front, v)
        return _on_way(self.curve, state, self.along(time + dt), self.along(time + 2 * dt), dt)

    def _commit(self, begins: Begins, time: float, front: float, v: float) -> None:
        """Fix the beginning if it lies within the two timesteps that are decided now."""
        moment = self._moment(begins, time, front, v)
        if moment < time - LATE_S:
            raise AgentError(
                f"a programmed {self.programme.kind} had to begin {time - moment:.1f} s ago to "
                "arrive with the ego; a script needs an earlier start_m"
            )
        if moment < time + 2 * self.dt:
            self.begun = max(moment, time + self.dt)
            self.ahead = self.programme.speed_mps * self.begun

    def _moment(self, begins: Begins, time: float, front: float, v: float) -> float:
        """When it has to begin, as far as is known now [s]."""
        if begins.at_s is not None:
            return begins.at_s
        assert begins.ego_at_m is not None
        left = begins.ego_at_m - front
        arrives = time + (left / v if v > 0.0 else math.inf if left > 0.0 else 0.0)
        if begins.own_at_m is None:
            return arrives
        return arrives - self.motion.when(begins.own_at_m - self.programme.speed_mps * time)


@dataclass
class TrackFollower:
    """One body that follows a track in one episode.

    Attributes:
        track: its places.
        dt: length of a timestep [s].
    """

    track: ScriptedTrack
    dt: float

    def action(self, state: BodyState, time: float, front: float, v: float) -> Action:
        """The action of a timestep; the ego is not looked at."""
        dt = self.dt
        return _to_places(state, self.track.at(time + dt), self.track.at(time + 2 * dt), dt)


@dataclass
class StoryFollower:
    """One body of a storyboard in one episode.

    Attributes:
        body: where it is at any time that is decided.
        dt: length of a timestep [s].
    """

    body: StoryBody
    dt: float

    def action(self, state: BodyState, time: float, front: float, v: float) -> Action:
        """The action of a timestep, whose motion the storyboard has decided."""
        body, dt = self.body, self.dt
        if time + 2 * dt > body.prescribed:
            return _to_places(state, body.place(time + dt), body.place(time + 2 * dt), dt)
        here, there = (body.along(time + k * dt)[0] for k in (1, 2))
        return _on_way(body.programme.way.curve, state, here, there, dt)


def _on_way(curve: PlaneCurve, state: BodyState, here: float, there: float, dt: float) -> Action:
    """The action of a body that will be at two distances on its way at the next timesteps."""
    throttle = ((there - here) / dt - state.v) / dt
    steers = curve.legs and state.v > 0.0
    steering = steering_to(state, *curve.at(here)[:2], dt) if steers else 0.0
    return Action(throttle, steering)


def _to_places(state: BodyState, here: Place, there: Place, dt: float) -> Action:
    """The action of a body that will be at two places at the next timesteps."""
    kind = state.body.kind
    steering = steering_to(state, *here, dt) if state.v > 0.0 else 0.0
    limits = kind.wheelbase, kind.v_min, kind.v_max, dt
    x, y, *_ = step_floats(*state[1:], 0.0, steering, *limits)
    # Who fell behind in a sharp turn catches up as fast as the track is anywhere.
    wanted = min(kind.v_max, math.dist((x, y), there) / dt)
    return Action((wanted - state.v) / dt, steering)


def _free(programme: Programme) -> bool:
    """Whether a storyboard moves a body."""
    return programme.track is None and programme.begins is None


def _follower(
    programme: Programme, begins: Begins | None, dt: float
) -> Follower | TrackFollower | StoryFollower:
    """The follower of a body in one episode."""
    if programme.track is not None:
        return TrackFollower(programme.track, dt)
    return Follower(programme, begins, dt)


def steering_to(state: BodyState, x: float, y: float, dt: float) -> float:
    """The steering by which a moving body is on the line to a point after a timestep [rad].

    The kinematics moves it in the direction o + beta + theta / 2; Newton's method on that.
    """
    kind, v = state.body.kind, state.v
    turn = wrap(math.atan2(y - state.y, x - state.x) - state.o)
    e, gain = 0.0, v * dt / kind.wheelbase
    for _ in range(ROUNDS):
        beta = math.atan(0.5 * math.tan(e))
        slope = 0.5 * (1.0 + math.tan(e) ** 2) / (1.0 + 0.25 * math.tan(e) ** 2)
        wrong = beta + gain * math.sin(beta) - turn
        e -= wrong / (slope * (1.0 + gain * math.cos(beta)))
        e = min(kind.steering_max, max(-kind.steering_max, e))
    return e
