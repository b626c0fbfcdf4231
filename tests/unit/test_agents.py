"""The seed's agents on snapshots made by hand: when they act, and for which bodies."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cavsumo.agents import AGENTS, Agent, Scene
from cavsumo.agents.behaviours import Walker
from cavsumo.errors import InputError
from cavsumo.model.bodies import KINDS, NOOP, Action, Body, clamped, model_of
from cavsumo.model.kinematics import step_floats
from cavsumo.model.snapshot import BodyState, Snapshot

State = tuple[float, float, float, float]
MakeScene = Callable[..., Scene]
See = Callable[..., Snapshot]

SOUTH, NORTH = -5.15, 5.15  # the pavements' axes [m]
ALONG = ((60.0, SOUTH, 0.0),)


def cast(scene: Scene, name: str, seed: int = 1, teams: Any = None, **params: Any) -> list[Agent]:
    """Agents of one name, ready to begin: one for each body, or one for each team."""
    owned = teams or [(i,) for i in range(len(scene.bodies))]
    agents = [AGENTS.make(name, params) for _ in owned]
    for i, (agent, team) in enumerate(zip(agents, owned, strict=True)):
        agent.reset(scene, team, np.random.default_rng((seed, i)))
    type(agents[0]).coordinate(agents, np.random.default_rng((seed, 99)))
    return agents


def acting(agents: Sequence[Agent], snapshot: Snapshot) -> list[bool]:
    """Which of the bodies do something; for agents that idle by doing nothing."""
    return [action != NOOP for agent in agents for action in agent.choose_action(snapshot)]


def following(snapshot: Snapshot, actions: Sequence[Action], dt: float) -> list[State]:
    """Where the testers are one timestep later."""
    return [
        step_floats(*s[1:], *a, s.body.kind.wheelbase, s.body.kind.v_min, s.body.kind.v_max, dt)
        for s, a in zip(snapshot.testers, actions, strict=True)
    ]


# noop and random ----------------------------------------------------------------------------------


def test_noop_keeps_going(straight_scene: MakeScene, scene_snapshot: See) -> None:
    """A body that does nothing walks on as it did: 1.4 m/s for 10 s make 14 m."""
    scene = straight_scene(ALONG)
    (agent,) = cast(scene, "noop")
    states: list[State] = [(60.0, SOUTH, 1.4, 0.0)]
    for step in range(100):
        snapshot = scene_snapshot(scene, testers=states, step=step)
        states = following(snapshot, agent.choose_action(snapshot), scene.dt)
    assert states[0] == pytest.approx((74.0, SOUTH, 1.4, 0.0))


@pytest.mark.parametrize("dt", [0.1, 0.02])
@pytest.mark.parametrize("rate", [0.6, 3.0])
def test_random_draws_at_its_rate_whatever_the_timestep(
    straight_scene: MakeScene, scene_snapshot: See, dt: float, rate: float
) -> None:
    """At r draws a second the chance of one in a timestep is 1 - exp(-r dt)."""
    p = -math.expm1(-rate * dt)
    assert draws(straight_scene, scene_snapshot, dt, rate_per_s=rate) == pytest.approx(
        20_000 * p, abs=5 * math.sqrt(20_000 * p * (1 - p))
    )


def test_random_draws_by_timestep_as_in_the_seed(
    straight_scene: MakeScene, scene_snapshot: See
) -> None:
    """An epsilon is a chance for each timestep, however long; 0 is never and 1 always."""
    counts = [draws(straight_scene, scene_snapshot, dt, epsilon=0.05) for dt in (0.1, 0.02)]
    assert counts[0] == counts[1] == pytest.approx(1000, abs=154)
    assert draws(straight_scene, scene_snapshot, 0.1, epsilon=0.0) == 0
    assert draws(straight_scene, scene_snapshot, 0.1, epsilon=1.0) == 20_000


def draws(make: MakeScene, see: See, dt: float, **params: Any) -> int:
    """In how many of 20 000 timesteps a random agent chooses something."""
    scene = make(ALONG, dt=dt)
    (agent,) = cast(scene, "random", between="noop", **params)
    snapshot = see(scene)
    return sum(agent.choose_action(snapshot) != (NOOP,) for _ in range(20_000))


def test_random_repeats_its_last_action_or_does_nothing(
    straight_scene: MakeScene, scene_snapshot: See
) -> None:
    """Between two draws CAV-Gym's variant repeats the last action, the seed's does nothing."""
    scene = straight_scene(ALONG)
    snapshot, chosen = scene_snapshot(scene), {}
    for between in ("repeat", "noop"):
        (agent,) = cast(scene, "random", epsilon=0.1, between=between)
        chosen[between] = [agent.choose_action(snapshot)[0] for _ in range(500)]
    (listed,) = cast(scene, "random", epsilon=0.1)  # Algorithm 2 as it is listed
    assert [listed.choose_action(snapshot)[0] for _ in range(500)] == chosen["noop"]
    last = NOOP
    for repeated, drawn in zip(chosen["repeat"], chosen["noop"], strict=True):
        last = last if drawn == NOOP else drawn
        assert repeated == last
    assert 20 < len(set(chosen["repeat"])) < 90


@settings(deadline=None)
@given(st.sampled_from(sorted(KINDS)), st.integers(0, 2**32 - 1), st.integers(1, 3))
def test_random_actions_can_be_executed(
    straight_scene: MakeScene, scene_snapshot: See, name: str, seed: int, bodies: int
) -> None:
    """Every draw is from A(s): within the limits of each body, also of a team of bodies."""
    scene = straight_scene(ALONG * bodies, kind=KINDS[name])
    space = model_of({"agent": scene.bodies}).agent_space("agent")
    (agent,) = cast(scene, "random", seed, [tuple(range(bodies))], epsilon=1.0)
    joint = agent.choose_action(scene_snapshot(scene))
    assert space.contains(np.array(joint, dtype=np.float64).ravel())
    assert all(clamped(action, KINDS[name]) == action for action in joint)
    assert len(set(joint)) == bodies, "the bodies of one agent draw one by one"


@pytest.mark.parametrize("name", ["random", "programmed-random", "q-learning"])
def test_the_same_generator_chooses_the_same_actions(
    straight_scene: MakeScene, scene_snapshot: See, name: str
) -> None:
    """An episode is repeated by repeating its seed, and another seed is another episode."""
    scene = straight_scene(ALONG)
    walk = scene_snapshot(scene, testers=[(60.0, SOUTH, 1.4, 0.0)])
    lives = []
    for seed in (1, 1, 2):
        (agent,) = cast(scene, name, seed)
        chosen = []
        for _ in range(300):
            chosen.append(agent.choose_action(walk))
            agent.process_feedback(walk, chosen[-1], 0.0, walk, False)
        lives.append(chosen)
    assert lives[0] == lives[1] != lives[2]


# Programmed random and proximity ------------------------------------------------------------------


def test_programmed_random_begins_to_cross_at_its_rate(
    straight_scene: MakeScene, scene_snapshot: See
) -> None:
    """At 0.5 a second a body sets off after 2 s on average; once it goes it does not draw again."""
    scene = straight_scene(ALONG)
    snapshot, waits = scene_snapshot(scene), []
    for seed in range(400):
        (agent,) = cast(scene, "programmed-random", seed, rate_per_s=0.5, idle="noop")
        waits.append(next(i for i in range(10_000) if acting([agent], snapshot)[0]))
        assert all(acting([agent], snapshot)[0] for _ in range(20))
    p = -math.expm1(-0.05)
    assert np.mean(waits) == pytest.approx((1 - p) / p, abs=5 * math.sqrt(1 - p) / p / 20)


@pytest.mark.parametrize(("epsilon", "sets_off"), [(0.0, False), (1.0, True)])
def test_programmed_random_by_timestep(
    straight_scene: MakeScene, scene_snapshot: See, epsilon: float, sets_off: bool
) -> None:
    """An epsilon of 1 crosses at once, one of 0 never."""
    scene = straight_scene(ALONG)
    (agent,) = cast(scene, "programmed-random", epsilon=epsilon, idle="noop")
    assert any(acting([agent], scene_snapshot(scene))[0] for _ in range(200)) is sets_off


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_proximity_triggers_below_its_distance_only(
    straight_scene: MakeScene, scene_snapshot: See, side: float
) -> None:
    """Twenty metres from centre to centre trigger nothing, a little less does, behind it too."""
    scene = straight_scene(ALONG)
    beside = SOUTH + 1.825
    for distance, crosses in ((20.001, False), (19.999, True)):
        (agent,) = cast(scene, "proximity", distance_m=20.0, idle="noop")
        x = 60.0 + side * math.sqrt(distance**2 - beside**2)
        assert acting([agent], scene_snapshot(scene, (x, 8.0))) == [crosses]


def test_proximity_without_a_road_to_cross_goes_on_idling(
    straight_scene: MakeScene, scene_snapshot: See
) -> None:
    """On an open plane there is nothing to cross, so nothing happens and nothing breaks."""
    scene = straight_scene(ALONG, open_plane=True)
    (agent,) = cast(scene, "proximity", idle="noop")
    assert acting([agent], scene_snapshot(scene, (59.0, 8.0))) == [False]


# Election -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rule", "winner"),
    [("ahead", "far"), ("unsigned", "behind")],
)
def test_the_nearest_is_elected(
    straight_scene: MakeScene, scene_snapshot: See, rule: str, winner: str
) -> None:
    """Ahead of the ego the nearer one; by CAV-Gym's unsigned rule one behind it may win."""
    places = {"farther": 70.0, "far": 60.0, "behind": 47.0}
    scene = straight_scene([(x, SOUTH, 0.0) for x in places.values()])
    agents = cast(scene, "election", rule=rule, idle="noop")
    going = acting(agents, scene_snapshot(scene, (50.0, 8.0)))
    assert [name for name, goes in zip(places, going, strict=True) if goes] == [winner]


def test_nobody_out_of_reach_is_elected(straight_scene: MakeScene, scene_snapshot: See) -> None:
    """Beyond the voting distance, or with all behind the ego, nobody crosses."""
    scene = straight_scene([(60.0, SOUTH, 0.0), (70.0, NORTH, math.pi)])
    for ego in (30.0, 72.0):
        agents = cast(scene, "election", distance_m=20.0, idle="noop")
        assert acting(agents, scene_snapshot(scene, (ego, 8.0))) == [False, False]


def test_a_tie_is_drawn_by_the_coordinator(straight_scene: MakeScene, scene_snapshot: See) -> None:
    """Two at the same distance win equally often, and the same seed elects the same one."""
    scene = straight_scene([(60.0, SOUTH, 0.0), (60.0, NORTH, math.pi)])
    snapshot = scene_snapshot(scene, (50.0, 8.0))
    elected = [acting(cast(scene, "election", seed, idle="noop"), snapshot) for seed in range(200)]
    again = [acting(cast(scene, "election", seed, idle="noop"), snapshot) for seed in range(200)]
    assert elected == again
    assert all(sum(going) == 1 for going in elected)
    assert sum(going[0] for going in elected) == pytest.approx(100, abs=36)  # 5 sigma


@pytest.mark.parametrize("teams", [None, [(0, 1), (2, 3)]])
def test_one_crosses_at_a_time_and_then_the_nearest_ahead(
    straight_scene: MakeScene, scene_snapshot: See, monkeypatch: pytest.MonkeyPatch, teams: Any
) -> None:
    """While one crosses nobody else does, whoever owns them; then the nearest ahead is next."""
    places = [(30.0, SOUTH, 0.0), (35.0, NORTH, math.pi), (45.0, SOUTH, 0.0), (55.0, SOUTH, 0.0)]
    scene = straight_scene(places)
    agents = cast(scene, "election", teams=teams, idle="noop", distance_m=60.0)
    states: list[State] = [(x, y, 0.0, o) for x, y, o in places]
    chosen: list[int] = []
    begin = Walker.begin

    def noted(walker: Walker, state: BodyState) -> bool:
        chosen.append(walker.index)
        return begin(walker, state)

    monkeypatch.setattr(Walker, "begin", noted)
    for step in range(300):
        ego_x, before = 10.0 + 0.2 * step, len(chosen)
        snapshot = scene_snapshot(scene, (ego_x, 2.0), states, step=step)
        joint = [action for agent in agents for action in agent.choose_action(snapshot)]
        # Who walks straight across does nothing special, but is not aligned with the road.
        going = {i for i, a in enumerate(joint) if a != NOOP or abs(math.sin(states[i][3])) > 1e-6}
        assert len(going) <= 1, "two at once"
        if chosen[before:]:
            ahead = {s[0] - ego_x: i for i, s in enumerate(states) if s[0] > ego_x}
            assert going == {ahead[min(ahead)]} == set(chosen[before:])
        states = following(snapshot, joint, scene.dt)
    assert len(chosen) >= 3
    assert len(set(chosen)) >= 2


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_who_arrives_leaves_the_election_open_in_the_same_timestep(
    straight_scene: MakeScene, scene_snapshot: See, order: tuple[int, int]
) -> None:
    """Algorithm 5 falls through as Algorithm 4 does, whoever of the two is asked first."""
    places = [(30.0, SOUTH, 0.0), (30.3, SOUTH, 0.0)]
    scene = straight_scene(places)
    agents: Any = cast(scene, "election", teams=[(i,) for i in order], idle="noop")
    states: list[State] = [(x, y, 0.0, o) for x, y, o in places]
    crossing: list[list[int]] = []
    for step in range(400):
        snapshot = scene_snapshot(scene, (10.0, 0.1), states, step=step)
        chosen = {a.owned[0]: a.choose_action(snapshot)[0] for a in agents}
        crossing.append([a.owned[0] for a in agents if a.behaviours[0].active])
        states = following(snapshot, [chosen[0], chosen[1]], scene.dt)
    assert all(len(going) == 1 for going in crossing)
    assert {going[0] for going in crossing} == {0, 1}


@pytest.mark.parametrize(
    ("name", "params"),
    [
        ("election", {"rule": "sideways"}),
        ("election", {"distance_m": -1.0}),
        ("proximity", {"idle": "sleep"}),
        ("timing", {"aim": 0.0}),
        ("timing", {"aim": 1.5}),
        ("random", {"between": "nothing"}),
        ("random", {"rate_per_s": -1.0}),
        ("random", {"epsilon": 1.1}),
        ("programmed-random", {"epsilon": "often"}),
    ],
)
def test_parameters_out_of_range_are_refused(name: str, params: dict[str, Any]) -> None:
    """The message names the agent and the parameter."""
    with pytest.raises(InputError, match=f"agent {name}: {next(iter(params))} must"):
        AGENTS.make(name, params)


def test_an_agent_acts_for_its_own_bodies_in_their_order(
    straight_scene: MakeScene, scene_snapshot: See
) -> None:
    """Of three bodies an agent owns the last and the first: only the last one is near the ego."""
    scene = straight_scene([(20.0, SOUTH, 0.0), (58.0, SOUTH, 0.0), (60.0, SOUTH, 0.0)])
    assert [body.id for body in scene.bodies] == ["tester0", "tester1", "tester2"]
    assert isinstance(scene.bodies[0], Body)
    (agent,) = cast(scene, "proximity", teams=[(2, 0)], distance_m=20.0, idle="noop")
    assert acting([agent], scene_snapshot(scene, (50.0, 8.0))) == [True, False]
