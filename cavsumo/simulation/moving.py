"""The testers' motion in one timestep, by the kinematics."""

from __future__ import annotations

from collections.abc import Sequence

from cavsumo.errors import AgentError
from cavsumo.model.bodies import Action
from cavsumo.model.kinematics import step_floats
from cavsumo.model.snapshot import BodyState


def moved(
    testers: tuple[BodyState, ...],
    teams: Sequence[Sequence[int]],
    actions: Sequence[Sequence[Action]],
    dt: float,
) -> tuple[BodyState, ...]:
    """The testers' next states by the kinematics (seed, eqs 8 to 19).

    A body that stands keeps the same record object, and if all do, so does their tuple: identity
    then tells, without comparing numbers, that nothing has changed.
    """
    moved: list[BodyState] = []
    for team, joint in zip(teams, actions, strict=True):
        if len(joint) != len(team):
            raise AgentError(f"an agent with {len(team)} bodies chose {len(joint)} actions")
        for i, (throttle, steering) in zip(team, joint, strict=True):
            state = testers[i]
            body, x, y, v, o = state
            kind = body.kind
            if not (
                kind.throttle_min - 1e-9 <= throttle <= kind.throttle_max + 1e-9
                and abs(steering) <= kind.steering_max + 1e-9
            ):
                raise AgentError(f"{body.id}: no such action: {throttle=}, {steering=}")
            if v == 0.0 and throttle <= 0.0 and kind.v_min == 0.0:
                continue
            moved = moved or list(testers)
            moved[i] = BodyState(
                body,
                *step_floats(
                    x, y, v, o, throttle, steering, kind.wheelbase, kind.v_min, kind.v_max, dt
                ),
            )
    return tuple(moved) if moved else testers
