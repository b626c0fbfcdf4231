"""Requirements on every tester agent: checks that play scripted drives to it."""

from __future__ import annotations

import json
import math
import random
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from cavsumo.agents.base import Agent
from cavsumo.egos.base import EGO_KIND
from cavsumo.model.bodies import Action
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import AROUND_M, BodyState, RawState, Snapshot
from cavsumo.testing.scripts import CROWDED, EMPTY, ODD, Script, ScriptNetwork, driven

MakeAgent = Callable[[], Agent]
Check = Callable[[MakeAgent, ScriptNetwork], str]
TESTERS, OWNED = 4, (0, 2)
EGO_SPEED = 7.0  # m/s
Joint = tuple[Action, ...]


def choices(
    agent: Agent, ground: ScriptNetwork, script: Script, seed: int = 1, *, apart: bool = False
) -> list[Joint]:
    """The actions of an agent with two of four bodies in a script, each checked.

    The ego drives past at constant speed; bodies of others stand. ``apart``: without background
    bodies near a tester.
    """
    scene = ground.scene(EGO_KIND, seed, TESTERS)
    agent.reset(scene, OWNED, np.random.default_rng(seed))
    type(agent).coordinate([agent], np.random.default_rng(seed + 1))
    states = tuple(
        BodyState(body, start.x, start.y, 0.0, start.o)
        for body, start in zip(scene.bodies, scene.starts, strict=True)
    )
    found: list[Joint] = []
    snapshot = _snapshot(scene, script, states, 0, apart)
    for step in range(script.steps):
        joint = tuple(agent.choose_action(snapshot))
        check_actions(joint, states, f"at {snapshot.time:g} s")
        found.append(joint)
        states = _moved(states, joint, scene.dt)
        successor = _snapshot(scene, script, states, step + 1, apart)
        agent.process_feedback(snapshot, joint, -0.1, successor, step + 1 == script.steps)
        snapshot = successor
    return found


def check_actions(joint: Sequence[Action], states: Sequence[BodyState], at: str) -> None:
    """Whether there is one action for each body owned, and their effectors can execute it."""
    assert len(joint) == len(OWNED), f"{at}: {len(joint)} actions for {len(OWNED)} bodies"
    for i, (throttle, steering) in zip(OWNED, joint, strict=True):
        kind = states[i].body.kind
        assert math.isfinite(throttle), f"{at}: throttle is {throttle!r}"
        assert math.isfinite(steering), f"{at}: steering angle is {steering!r}"
        assert kind.throttle_min - 1e-9 <= throttle <= kind.throttle_max + 1e-9, (
            f"{at}: throttle {throttle!r} is not in "
            f"[{kind.throttle_min:g}, {kind.throttle_max:g}] m/s2"
        )
        assert abs(steering) <= kind.steering_max + 1e-9, (
            f"{at}: steering angle {steering!r} is larger than {kind.steering_max:g} rad"
        )


# The checks


def check_acts_for_its_bodies(make: MakeAgent, ground: ScriptNetwork) -> str:
    """One action that can be executed for each body it owns, on an empty and a crowded road."""
    agent = make()
    count = len(choices(agent, ground, EMPTY)) + len(choices(agent, ground, CROWDED))
    return f"{count} joint actions"


def check_repeatable(make: MakeAgent, ground: ScriptNetwork) -> str:
    """The same scene, generator and memory give the same actions, also after other episodes."""
    agent = make()
    known = agent.recall()
    first = choices(agent, ground, CROWDED)
    choices(agent, ground, EMPTY, seed=2)
    if known is not None:
        agent.remember(known)
    assert choices(agent, ground, CROWDED) == first, "a second instance chose other actions"
    assert choices(make(), ground, CROWDED) == first, "another one of it chose other actions"
    return f"{len(first)} joint actions, three times the same"


def check_draws_from_its_generator_only(make: MakeAgent, ground: ScriptNetwork) -> str:
    """The global generators stay unused."""
    before = random.getstate(), repr(np.random.get_state())
    choices(make(), ground, CROWDED)
    assert before[0] == random.getstate(), "it drew from the module random"
    assert before[1] == repr(np.random.get_state()), "it drew from numpy.random"
    return "draws from its own only"


def check_memory(make: MakeAgent, ground: ScriptNetwork) -> str:
    """Its knowledge is plain data, and another instance that takes it up acts alike."""
    agent = make()
    choices(agent, ground, CROWDED)
    memory = agent.recall()
    if memory is None:
        assert not agent.learns, "it learns, and recalls nothing"
        return "learns nothing"
    text = json.dumps(memory, allow_nan=False)
    other = make()
    other.remember(json.loads(text))
    again = choices(other, ground, EMPTY)
    agent.remember(json.loads(text))
    assert choices(agent, ground, EMPTY) == again, "what it recalls is not all that it learned"
    return f"{len(text)} bytes"


def check_sees_what_it_says(make: MakeAgent, ground: ScriptNetwork) -> str:
    """An agent with ``sees_background = False`` uses at most the bodies beside it."""
    if make().sees_background:
        return "looks at the background"
    seen = choices(make(), ground, CROWDED, apart=True)
    assert seen == choices(make(), ground, EMPTY), "the background changed what it did"
    return "the background changes nothing"


def check_odd_numbers(make: MakeAgent, ground: ScriptNetwork) -> str:
    """Tiny, huge and negative numbers, names with quotes."""
    return f"{len(choices(make(), ground, ODD))} joint actions"


CHECKS: Mapping[str, Check] = {
    "acts for its bodies": check_acts_for_its_bodies,
    "repeatable": check_repeatable,
    "its own generator": check_draws_from_its_generator_only,
    "memory": check_memory,
    "sees what it says": check_sees_what_it_says,
    "odd numbers": check_odd_numbers,
}


def _snapshot(
    scene: Scene, script: Script, states: tuple[BodyState, ...], step: int, apart: bool
) -> Snapshot:
    """The snapshot of a timestep."""
    along = min(EGO_SPEED * step * scene.dt, scene.ego_path.length)
    x, y, o = scene.ego_path.at(along)
    ego = BodyState(scene.ego, x, y, EGO_SPEED, o)
    time = round(step * scene.dt, 6)
    others = script.others(scene, step)
    if apart:
        others = tuple([other for other in others if _is_apart(other, states)])
    return Snapshot(step, time, ego, 0.0, states, others)


def _is_apart(other: RawState, states: Sequence[BodyState]) -> bool:
    """Whether a body is farther from all testers than those that are always shown."""
    return all(
        math.hypot(other[1] - state.x, other[2] - state.y)
        > other[0].kind.reach + state.body.kind.reach + AROUND_M
        for state in states
    )


def _moved(states: tuple[BodyState, ...], joint: Joint, dt: float) -> tuple[BodyState, ...]:
    """The bodies after a timestep."""
    moved = list(states)
    for i, action in zip(OWNED, joint, strict=True):
        moved[i] = driven(states[i], action, dt)
    return tuple(moved)
