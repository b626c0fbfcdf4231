"""An episode simulated ahead: against an ego that keeps its speed all states are known in advance.

It is exact if the ego follows its path and drives straight when it meets the body; curved zones,
which follow its steering, are not predicted.
"""

from __future__ import annotations

from cavsumo.agents.body_policy import BodyPolicy
from cavsumo.agents.triggers import MAX_DECEL, REACTION_TIME
from cavsumo.model.kinematics import step_floats
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.model.stopping_zones import zone_entered


def succeeds(scene: Scene, snapshot: Snapshot, policy: BodyPolicy) -> bool:
    """Whether a body that plays alone enters the reaction zone first, by a new policy."""
    path, ego = scene.ego_path, snapshot.ego
    if ego.v <= 0.0:
        return False
    along, end = scene.ego_progress(snapshot), path.length - ego.body.kind.length / 2
    while True:
        state = snapshot.testers[policy.index]
        zone = _zone(snapshot, state)
        if zone is not None:
            return zone == "reaction"
        along += ego.v * scene.dt
        time = snapshot.time + scene.dt
        if along > end or time > scene.horizon + 1e-9 or _behind(scene, policy, along):
            return False
        testers = list(snapshot.testers)
        testers[policy.index] = _moved(scene, snapshot, state, policy)
        x, y, o = path.at(along)
        driven = BodyState(ego.body, x, y, ego.v, o)
        snapshot = Snapshot(snapshot.step + 1, time, driven, 0.0, tuple(testers))


def _zone(snapshot: Snapshot, state: BodyState) -> str | None:
    """The zone that a body touches."""
    ego = snapshot.ego
    return zone_entered(
        state.box,
        ego.box,
        ego.v,
        max_decel=MAX_DECEL,
        reaction_time=REACTION_TIME,
        wheelbase=ego.body.kind.wheelbase,
    )


def _behind(scene: Scene, policy: BodyPolicy, along: float) -> bool:
    """Whether the ego has passed the body's way."""
    met = policy.where.meeting
    return met is None or along - scene.ego.kind.length > met.along


def _moved(scene: Scene, snapshot: Snapshot, state: BodyState, policy: BodyPolicy) -> BodyState:
    """The body after a timestep."""
    if not policy.going:
        idle = policy.idle(snapshot)
        policy.going = policy.due(snapshot, idle) > 0.0
    action = policy.go(snapshot) if policy.going else idle
    kind = state.body.kind
    if state.v == 0.0 and action.throttle <= 0.0:
        return state
    limits = kind.wheelbase, kind.v_min, kind.v_max, scene.dt
    return BodyState(state.body, *step_floats(*state[1:], *action, *limits))
