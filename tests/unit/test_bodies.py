"""Definition 1: who owns what, the actions of each effector, and the kinds of body."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from gymnasium import spaces
from hypothesis import given, settings
from hypothesis import strategies as st

from cavsumo.errors import InputError, UnknownName
from cavsumo.model.bodies import (
    BUS,
    CAR,
    KINDS,
    PEDESTRIAN,
    Action,
    AgentBodyEffectorModel,
    Body,
    clamped,
    kind_named,
    model_of,
)

CALM = settings(deadline=None)
CAV_GYM = {
    "pedestrian": (0.65625, 0.875, 0.328125, 1.4, 1.4, 0.4 * math.pi),
    "car": (4.5, 1.75, 3.0, 9.0, 9.0, 0.2 * math.pi),
    "bus": (12.0, 2.55, 16.875, 6.75, 6.75, 0.16 * math.pi),
    "bicycle": (2.25, 0.875, 2.025, 4.5, 4.5, 0.5 * math.pi),
}

TEAMS = {
    "anna": [Body("p0", PEDESTRIAN), Body("p1", PEDESTRIAN)],
    "bert": [Body("c0", CAR)],
}


def model(**changes: Any) -> AgentBodyEffectorModel:
    """Two agents with three bodies of one effector each, with some parts changed."""
    parts: dict[str, Any] = {
        "agents": ("anna", "bert"),
        "body_agent": {"p0": "anna", "p1": "anna", "c0": "bert"},
        "effector_body": {"legs0": "p0", "legs1": "p1", "pedals": "c0"},
        "actions": {"legs0": (-1.0, 1.0), "legs1": (-1.0, 1.0), "pedals": (-9.0, 9.0)},
    }
    return AgentBodyEffectorModel(**(parts | changes))


def maps(domain: str, codomain: str) -> st.SearchStrategy[tuple[tuple[str, ...], dict[str, str]]]:
    """Any map between two finite sets, surjective or not, with its codomain."""
    return st.integers(1, 4).flatmap(
        lambda n: st.tuples(
            st.just(tuple(f"{codomain}{i}" for i in range(n))),
            st.lists(st.integers(0, n - 1), min_size=1, max_size=7).map(
                lambda images: {f"{domain}{i}": f"{codomain}{j}" for i, j in enumerate(images)}
            ),
        )
    )


# The two surjections ------------------------------------------------------------------------------


def test_an_agent_without_a_body_is_refused() -> None:
    """An agent that owns nothing could not act, and the message names it."""
    with pytest.raises(InputError, match="no bodies for carl"):
        model(agents=("anna", "bert", "carl"))


def test_a_body_without_an_effector_is_refused() -> None:
    """A body that nothing moves is an obstacle and belongs to the world, not to an agent."""
    with pytest.raises(InputError, match="no effectors for c0"):
        model(effector_body={"legs0": "p0", "legs1": "p1"})


def test_a_body_of_an_unknown_agent_is_refused() -> None:
    """A body cannot belong to somebody who does not play; the nearest player is suggested."""
    with pytest.raises(UnknownName, match=r"bret.*did you mean 'bert'"):
        model(body_agent={"p0": "anna", "p1": "anna", "c0": "bret"})


def test_an_effector_of_an_unknown_body_is_refused() -> None:
    """An effector cannot move a body that is not there; the nearest body is suggested."""
    with pytest.raises(UnknownName, match=r"p11.*did you mean 'p1'"):
        model(effector_body={"legs0": "p0", "legs1": "p11", "pedals": "c0"})


def test_a_model_without_agents_is_refused() -> None:
    """Nobody playing is no game."""
    with pytest.raises(InputError, match="needs agents"):
        AgentBodyEffectorModel((), {}, {}, {})


def test_a_body_with_two_owners_is_refused() -> None:
    """A body obeys one agent: handing it to two is a mistake, not a change of owner."""
    shared = Body("p0", PEDESTRIAN)
    with pytest.raises(InputError):
        model_of({"anna": [shared, Body("p1", PEDESTRIAN)], "bert": [shared]})


@CALM
@given(maps("body", "agent"), st.data())
def test_corollary_1(bodies: tuple[tuple[str, ...], dict[str, str]], data: st.DataObject) -> None:
    """Of any two maps, either one is no surjection or |N| <= |B| <= |E|."""
    agents, body_agent = bodies
    owned = tuple(body_agent)
    images = data.draw(st.lists(st.sampled_from(owned), min_size=1, max_size=9))
    effector_body = {f"e{i}": body for i, body in enumerate(images)}
    actions = dict.fromkeys(effector_body, (0.0, 1.0))
    surjective = set(body_agent.values()) == set(agents) and set(images) == set(owned)
    if not surjective:
        with pytest.raises(InputError):
            AgentBodyEffectorModel(agents, body_agent, effector_body, actions)
        return
    built = AgentBodyEffectorModel(agents, body_agent, effector_body, actions)
    assert len(built.agents) <= len(built.body_agent) <= len(built.effector_body)
    assert_partition([built.bodies([a]) for a in agents], owned)
    assert_partition([built.effectors([b]) for b in owned], tuple(effector_body))
    assert_partition([built.effectors(built.bodies([a])) for a in agents], tuple(effector_body))


def assert_partition(parts: list[tuple[str, ...]], whole: tuple[str, ...]) -> None:
    """The parts are not empty and every element is in exactly one of them."""
    assert all(parts)
    assert sorted(x for part in parts for x in part) == sorted(whole)


# Inverse images -----------------------------------------------------------------------------------


def test_bodies_of_agents_and_effectors_of_bodies() -> None:
    """B(N') and E(B') by hand, for none, some and all."""
    m = model_of(TEAMS)
    assert m.bodies(["anna"]) == ("p0", "p1")
    assert m.bodies(["bert", "anna"]) == ("p0", "p1", "c0")
    assert m.bodies([]) == ()
    assert m.effectors(["c0"]) == ("c0.throttle", "c0.steering")
    assert m.effectors(m.bodies(["anna"])) == (
        "p0.throttle",
        "p0.steering",
        "p1.throttle",
        "p1.steering",
    )


def test_asking_for_a_stranger_suggests_the_nearest() -> None:
    """A misspelt agent or body is answered with the one that was probably meant."""
    m = model_of(TEAMS)
    with pytest.raises(UnknownName, match="did you mean 'anna'"):
        m.bodies(["ana"])
    with pytest.raises(UnknownName, match="did you mean 'c0'"):
        m.effectors(["c00"])


# Actions ------------------------------------------------------------------------------------------


def test_the_action_space_of_an_agent_is_the_product_over_its_effectors() -> None:
    """Two pedestrians make one box of four dimensions with their limits, as Gymnasium has it."""
    space = model_of(TEAMS).agent_space("anna")
    e = 0.4 * math.pi
    assert isinstance(space, spaces.Box)
    assert space.dtype == np.float64
    assert space.low.tolist() == [-1.4, -e, -1.4, -e]
    assert space.high.tolist() == [1.4, e, 1.4, e]


def test_an_agent_with_a_car_has_the_cars_limits() -> None:
    """Bert's pedals reach 9 m/s2 either way and his wheels 36 degrees."""
    space = model_of(TEAMS).agent_space("bert")
    assert space.low.tolist() == [-9.0, -0.2 * math.pi]
    assert space.high.tolist() == [9.0, 0.2 * math.pi]


@CALM
@given(st.integers(0, 2**32 - 1), st.sampled_from(sorted(KINDS)), st.integers(1, 3))
def test_an_action_space_contains_its_samples(seed: int, kind: str, bodies: int) -> None:
    """What is drawn from A(E') can be executed by the bodies that it was drawn for."""
    team = [Body(f"b{i}", KINDS[kind]) for i in range(bodies)]
    space = model_of({"agent": team}).agent_space("agent")
    space.seed(seed)
    sample = space.sample()
    assert space.contains(sample)
    for i in range(bodies):
        action = Action(float(sample[2 * i]), float(sample[2 * i + 1]))
        assert clamped(action, KINDS[kind]) == action


@pytest.mark.parametrize("interval", [(1.0, -1.0), (math.nan, 1.0), (0.0, math.inf), None])
def test_an_effector_without_actions_is_refused(interval: tuple[float, float] | None) -> None:
    """A(e) is not empty, so an interval that holds no number, or has no bound, is refused."""
    actions = {"legs0": (-1.0, 1.0), "legs1": (-1.0, 1.0)}
    with pytest.raises(InputError, match="'pedals' has no actions"):
        model(actions=actions if interval is None else actions | {"pedals": interval})


def test_an_effector_with_a_single_action_is_allowed() -> None:
    """A locked steering wheel is still an effector: [0, 0] holds one action."""
    actions = {"legs0": (-1.0, 1.0), "legs1": (-1.0, 1.0), "pedals": (0.0, 0.0)}
    assert model(actions=actions).agent_space("bert").sample().tolist() == [0.0]


@CALM
@given(st.floats(-1e3, 1e3), st.floats(-10, 10), st.sampled_from(sorted(KINDS)))
def test_clamping_gives_the_nearest_executable_action(t: float, e: float, name: str) -> None:
    """An action inside the limits stays, one outside moves to the limit it passed."""
    kind = KINDS[name]
    throttle, steering = clamped(Action(t, e), kind)
    assert throttle == pytest.approx(np.clip(t, kind.throttle_min, kind.throttle_max), abs=0)
    assert steering == pytest.approx(np.clip(e, -kind.steering_max, kind.steering_max), abs=0)


# Kinds --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(CAV_GYM))
def test_kinds_carry_the_constants_of_cav_gym(name: str) -> None:
    """Box, wheelbase and limits are CAV-Gym's, so that runs can be compared."""
    kind = kind_named(name)
    length, width, wheelbase, v_max, throttle, steering = CAV_GYM[name]
    assert (kind.length, kind.width, kind.wheelbase) == (length, width, wheelbase)
    assert (kind.v_min, kind.v_max) == (0.0, v_max)
    assert (kind.throttle_min, kind.throttle_max) == (-throttle, throttle)
    assert kind.steering_max == pytest.approx(steering, rel=1e-15)


def test_there_are_four_kinds_and_all_can_steer_by_the_kinematics() -> None:
    """The bicycle's right angle is open: every steering limit lies below pi / 2."""
    assert sorted(KINDS) == sorted(CAV_GYM)
    assert all(0.0 < kind.steering_max < math.pi / 2 for kind in KINDS.values())


def test_an_unknown_kind_suggests_the_nearest() -> None:
    """Whoever asks for a pedestrain is told of the pedestrian."""
    with pytest.raises(UnknownName, match="did you mean 'pedestrian'"):
        kind_named("pedestrain")


def test_no_point_of_a_box_is_farther_than_its_reach() -> None:
    """The reach is half the diagonal: 12 m by 2.55 m make 6.134 m."""
    assert BUS.reach == pytest.approx(6.13397, abs=1e-5)
