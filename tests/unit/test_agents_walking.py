"""How the agents' bodies walk by the kinematics: over the road, timed to the ego, to the kerb."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from random import Random
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.affinity import rotate
from shapely.geometry import LineString, Polygon, box

from cavsumo.agents import AGENTS, Agent, Scene
from cavsumo.agents.exposed import ExposureAgent
from cavsumo.agents.programme import WalkProgramme
from cavsumo.agents.searched import SearchAgent
from cavsumo.agents.triggers import Timing
from cavsumo.egos.base import EGO_KIND
from cavsumo.model.bodies import NOOP, PEDESTRIAN, Body
from cavsumo.model.carriageway import MarkedCrossing, Roads, Start
from cavsumo.model.geometry import corners
from cavsumo.model.kinematics import step_floats
from cavsumo.model.polyline import Path
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.model.stopping_zones import stopping_distances, zone_entered

State = tuple[float, float, float, float]
MakeScene = Callable[..., Scene]

KERB, SOUTH, LANE = -3.65, -5.15, -1.825  # m
SPEED = 6.75  # of the ego [m/s]
ZONES = {"max_decel": 9.0, "reaction_time": 0.675, "wheelbase": EGO_KIND.wheelbase}


def played(
    scene: Scene, agent: Agent, first: State, ego: State, seconds: float, lights: str = ""
) -> Iterator[Snapshot]:
    """What is seen while one body acts, the ego keeps its speed and heading, and lights stay."""
    agent.reset(scene, [0], np.random.default_rng(1))
    state = first
    for step in range(round(seconds / scene.dt) + 1):
        x, y, v, o = ego
        t = step * scene.dt
        driver = BodyState(scene.ego, x + v * t * math.cos(o), y + v * t * math.sin(o), v, o)
        bodies = (BodyState(scene.bodies[0], *state),)
        snapshot = Snapshot(step, t, driver, 0.0, bodies, crossing_lights=tuple(lights))
        yield snapshot
        (action,) = agent.choose_action(snapshot)
        kind = scene.bodies[0].kind
        state = step_floats(*state, *action, kind.wheelbase, kind.v_min, kind.v_max, scene.dt)


def seen_from(angle: float, state: BodyState) -> State:
    """A state as seen from a road that is turned by an angle about the origin."""
    c, s = math.cos(angle), math.sin(angle)
    o = math.remainder(state.o - angle, math.tau)
    return state.x * c + state.y * s, state.y * c - state.x * s, state.v, o


# Across the road ----------------------------------------------------------------------------------


def assert_crossed(states: Sequence[State], first: State) -> None:
    """A walk over the carriageway |y| < 3.65: at right angles, to the mirror point, and on."""
    on_road = [s for s in states if abs(s[1]) < -KERB]
    assert on_road, "never reached the carriageway"
    to = -math.copysign(1.0, first[1])
    assert all(o == pytest.approx(to * math.pi / 2, abs=1e-6) for _, _, _, o in on_road)
    xs = [x for x, _, _, _ in on_road]
    assert max(xs) - min(xs) < 1e-5
    assert abs(xs[0] - first[0]) < 1.5  # it turns at once, on its own pavement
    _, y, v, o = states[-1]
    assert to * y == pytest.approx(abs(first[1]), abs=0.6)
    assert to * y > -KERB
    assert math.remainder(o - first[3], math.tau) == pytest.approx(0.0, abs=1e-5)
    assert v == PEDESTRIAN.v_max


@pytest.mark.parametrize("dt", [0.1, 1 / 50])
@pytest.mark.parametrize("v", [0.0, 1.4])
@pytest.mark.parametrize("first", [(50.0, SOUTH, 0.0), (50.0, -SOUTH, 0.0), (50.0, -4.3, math.pi)])
def test_a_crossing_leads_straight_over_and_on_as_before(
    straight_scene: MakeScene, dt: float, v: float, first: tuple[float, float, float]
) -> None:
    """At right angles across, from standing or walking, and beyond the far kerb as before."""
    scene = straight_scene([first], dt=dt)
    x, y, o = first
    agent = AGENTS.make("programmed-random", {"epsilon": 1.0})
    frames = list(played(scene, agent, (x, y, v, o), (0.0, LANE, 0.0, 0.0), 30.0))
    states = [s.testers[0][1:] for s in frames]
    over = next(i for i, s in enumerate(states) if -math.copysign(1.0, y) * s[1] > -KERB)
    done = next(i for i in range(over, len(states)) if abs(math.sin(states[i][3])) < 1e-6)
    assert_crossed(states[: done + 1], (x, y, v, o))


@settings(deadline=None, max_examples=40)
@given(
    st.floats(-math.pi, math.pi),
    st.floats(10.0, 90.0),
    st.sampled_from([-5.9, SOUTH, -4.3, 4.3, -SOUTH, 5.9]),
    st.booleans(),
)
def test_a_crossing_on_a_road_that_leads_anywhere(
    angle: float, x: float, y: float, forwards: bool
) -> None:
    """The way across is at right angles to the road, whichever way the road leads."""
    o = 0.0 if forwards else math.pi
    scene = turned_scene(angle, (x, y, o))
    start = scene.starts[0]
    agent = AGENTS.make("proximity", {"distance_m": 500.0})
    walk = played(scene, agent, (start.x, start.y, 1.4, start.o), (0.0, 0.0, 0.0, angle), 9.0)
    states = [seen_from(angle, s.testers[0]) for s in walk]
    back = [i for i, s in enumerate(states) if s[1] * y < 0 and abs(math.sin(s[3])) < 1e-6]
    assert back, "never turned back"
    assert_crossed(states[: back[0] + 1], (x, y, 1.4, o))


def turned_scene(angle: float, start: tuple[float, float, float]) -> Scene:
    """The straight road turned about the origin, with one pedestrian."""
    c, s = math.cos(angle), math.sin(angle)
    lanes = [LineString([(0, LANE), (99, LANE)]), LineString([(99, -LANE), (0, -LANE)])]
    area: Polygon = box(0.0, KERB, 99.0, -KERB)
    turn = {"origin": (0, 0), "use_radians": True}
    lanes = [rotate(lane, angle, **turn) for lane in lanes]
    x, y, o = start
    return Scene(
        dt=0.1,
        ego=Body("ego", EGO_KIND),
        ego_path=Path(lanes[0].coords),
        bodies=(Body("tester0", PEDESTRIAN),),
        starts=(Start(x * c - y * s, x * s + y * c, math.remainder(o + angle, math.tau)),),
        roads=Roads(rotate(area, angle, **turn), lanes),
    )


def test_who_walked_over_does_not_return_by_himself(straight_scene: MakeScene) -> None:
    """Beyond the road the idle behaviour of the start no longer holds: the body walks on there."""
    scene = straight_scene([(50.0, SOUTH, 0.0)])
    for idle in ("pavement", "kerb", "noop"):
        # Near when the ego passes, out of reach for ever after.
        agent = AGENTS.make("proximity", {"distance_m": 12.0, "idle": idle})
        walk = played(scene, agent, (50.0, SOUTH, 1.4, 0.0), (2.0, LANE, 9.0, 0.0), 20.0)
        states = [s.testers[0][1:] for s in walk]
        over = next(i for i, s in enumerate(states) if s[1] > -KERB)
        assert all(s[1] > -KERB for s in states[over:]), idle
        assert states[-1][2] == PEDESTRIAN.v_max, idle


# Timed to the ego ---------------------------------------------------------------------------------


def first_zone(scene: Scene, agent: Agent, first: State) -> tuple[str | None, float]:
    """The zone of the ego that a body first touches, and how far ahead of its bumper [m]."""
    for snapshot in played(scene, agent, first, (2.25, LANE, SPEED, 0.0), 94.0 / SPEED):
        body, ego = snapshot.testers[0], snapshot.ego
        zone = zone_entered(body.box, ego.box, ego.v, steering=0.0, **ZONES)
        if zone is not None:
            near = min(x for x, _ in corners(body.box))
            return zone, near - ego.x - EGO_KIND.length / 2
    return None, math.inf


def seeded_starts(count: int) -> list[tuple[float, float, float]]:
    """Places on both pavements, facing either way."""
    rng = np.random.default_rng(42)
    sides, ways = rng.choice([SOUTH, -SOUTH], count), rng.choice([0.0, math.pi], count)
    return [
        (float(x), float(y), float(o))
        for x, y, o in zip(rng.uniform(1.0, 98.0, count), sides, ways, strict=True)
    ]


@pytest.mark.parametrize("dt", [0.1, 0.02])
@pytest.mark.parametrize("aim", [0.3, 0.5, 1.0])
def test_timing_steps_into_the_reaction_zone(
    straight_scene: MakeScene, dt: float, aim: float
) -> None:
    """Before an ego of 6.75 m/s: never unfair, and as far ahead of it as was aimed at."""
    braking, reaction = stopping_distances(SPEED, max_decel=9.0, reaction_time=0.675)
    entered = []
    for start in seeded_starts(30):
        scene = straight_scene([start], dt=dt)
        agent = AGENTS.make("timing", {"aim": aim})
        zone, ahead = first_zone(scene, agent, (*start[:2], PEDESTRIAN.v_max, start[2]))
        entered.append(zone)
        if zone is not None:
            assert zone == "reaction", start
            assert braking < ahead <= braking + aim * reaction + SPEED * dt, start
    assert entered.count("reaction") >= 0.6 * len(entered)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=40, deadline=None)
def test_the_timing_trigger_looks_away_only_when_it_cannot_hold(seed: int) -> None:
    """Wherever the ego goes, beside its winding path too: the answer is that of one who looks."""
    random = Random(seed)
    bends = [(0.0, 0.0), (40.0, 0.0), (60.0, 25.0), (60.0, 60.0), (90.0, 60.0)]
    roads = Roads(box(70.0, 55.0, 95.0, 65.0), [LineString([(70.0, 60.0), (95.0, 60.0)])])
    starts = (Start(80.0, 53.0, 0.0),)
    scene = Scene(0.1, Body("ego", EGO_KIND), Path(bends), (Body("t", PEDESTRIAN),), starts, roads)
    lazy = Timing(scene, 0, 0.5)
    state = BodyState(scene.bodies[0], 80.0, 53.0, 0.0, math.pi / 2)
    v, spared = 8.0, 0
    for step in range(400):
        x, y, o = scene.ego_path.at(0.3 * step)
        v = min(15.0, max(0.0, v + random.uniform(-1.0, 1.0)))
        x, y = x + random.uniform(-2.0, 2.0), y + random.uniform(-2.0, 2.0)
        snapshot = Snapshot(step, 0.1 * step, BodyState(scene.ego, x, y, v, o), 0.0, (state,))
        looks = Timing(dataclasses.replace(scene, _progress=[None, None]), 0, 0.5)
        gap, least = looks.gap_at_entry(snapshot, state), lazy.least_gap(snapshot, state)
        assert gap is not None
        assert least <= abs(gap) + 1e-9
        assert lazy(snapshot, state) == looks(snapshot, state)
        spared += lazy._projected[:2] != (x, y)
    assert spared > 20


def test_timing_by_hand(straight_scene: MakeScene) -> None:
    """A pedestrian beyond the far lane goes when the ego is as far away as she needs.

    From y = 5.15 to the strip at y = -0.95 her front has 6.1 - 0.328125 = 5.771875 m to go: 4.12277
    s at 1.4 m/s and one timestep of 0.1 s, in which the ego drives 28.50369 m. The gap in front of
    her is then 60 - 0.4375 - 2.25 - 28.50369 - x for an ego centred at x. She goes once it is at
    most 2.53125 + 0.5 * 4.55625 m, from x = 23.99943 on, and not with less than 2.53125 m, after
    x = 26.27756; a small margin to that is hers.
    """
    scene = straight_scene([(60.0, -SOUTH, math.pi)])
    agent: Any = AGENTS.make("timing", {"aim": 0.5, "idle": "noop"})
    goes = []
    for x in np.arange(20.0, 30.0, 0.01):
        agent.reset(scene, [0], np.random.default_rng(1))
        ego = BodyState(scene.ego, float(x), LANE, SPEED, 0.0)
        tester = BodyState(scene.bodies[0], 60.0, -SOUTH, 1.4, -math.pi / 2)
        seen = Snapshot(0, 0.0, ego, 0.0, (tester,))
        if agent.choose_action(seen) != (NOOP,) or agent.behaviours[0].active:
            goes.append(float(x))
    assert min(goes) == pytest.approx(23.99943, abs=0.011)
    assert 25.5 < max(goes) < 26.27756
    assert len(goes) == round((max(goes) - min(goes)) / 0.01) + 1


def test_a_trigger_that_holds_where_the_behaviour_ends_begins_it_at_once(
    straight_scene: MakeScene,
) -> None:
    """Algorithm 4, line 3: after the terminator the trigger is asked in the same timestep."""
    scene = straight_scene([(50.0, SOUTH, 0.0)])
    agent: Any = AGENTS.make("proximity", {"distance_m": 500.0})
    walk = played(scene, agent, (50.0, SOUTH, 1.4, 0.0), (50.0, LANE, 0.0, 0.0), 40.0)
    next(walk)  # as it is before the first action
    sides = []
    for snapshot in walk:
        assert agent.behaviours[0].active
        sides.append(snapshot.testers[0].y > 0.0)
    assert sum(a != b for a, b in pairwise(sides)) >= 3, "it never crosses back"


def test_where_the_behaviour_ends_and_nothing_triggers_no_action_is_chosen(
    straight_scene: MakeScene,
) -> None:
    """Algorithm 4, last line: in the very timestep in which the terminator holds."""
    scene = straight_scene([(50.0, SOUTH, 0.0)])
    agent: Any = AGENTS.make("proximity", {"distance_m": 20.0})
    first = (50.0, SOUTH, 1.4, 0.0)
    ends = []
    for snapshot in played(scene, agent, first, (45.0, LANE, 6.0, 0.0), 20.0):
        over = agent.behaviours[0].active and agent.behaviours[0].over(snapshot.testers[0])
        if over:
            ends.append(agent.choose_action(snapshot))
            assert not agent.behaviours[0].active
    assert ends == [(NOOP,)]


# At the kerb --------------------------------------------------------------------------------------


def waited(make: MakeScene, first: State, dt: float) -> list[BodyState]:
    """How a body goes to the kerb and waits, for ten seconds."""
    scene = make([(first[0], first[1], first[3])], dt=dt)
    agent = AGENTS.make("proximity", {"distance_m": 0.0, "idle": "kerb"})
    return [s.testers[0] for s in played(scene, agent, first, (0.0, LANE, 0.0, 0.0), 10.0)]


@settings(deadline=None, max_examples=25)
@given(
    st.floats(10.0, 90.0),
    st.floats(4.5, 6.1),
    st.sampled_from([0.0, math.pi]),
    st.floats(0.0, 1.4),
    st.sampled_from([0.1, 0.02]),
    st.sampled_from([-1.0, 1.0]),
)
def test_who_waits_at_the_kerb_stays_off_the_carriageway(
    straight_scene: MakeScene, x: float, y: float, o: float, v: float, dt: float, side: float
) -> None:
    """From the pavement, at any pace: stops before the kerb, facing the road, and stays there."""
    states = waited(straight_scene, (x, side * y, v, o), dt)
    assert_off_the_road(states)
    assert states[-1].o == pytest.approx(-side * math.pi / 2, abs=1e-6)
    assert 0.0 < side * states[-1].y - PEDESTRIAN.length / 2 + KERB < 0.15
    assert states[-1].v == pytest.approx(0.0, abs=1e-3)
    assert math.dist(states[-1][1:3], states[-round(1 / dt)][1:3]) < 0.01


@pytest.mark.parametrize("dt", [0.1, 0.02])
def test_who_starts_at_the_very_kerb_stays_off_the_carriageway(
    straight_scene: MakeScene, dt: float
) -> None:
    """Starts are drawn up to half a diagonal from the kerb: from there, too."""
    assert_off_the_road(waited(straight_scene, (50.0, -4.2, 1.4, 0.0), dt))


@pytest.mark.parametrize("dt", [0.2, 0.5, 1.0])
def test_coarse_timesteps_do_not_lead_over_the_kerb(straight_scene: MakeScene, dt: float) -> None:
    """However long a timestep is, a body brakes early enough to stop before the carriageway."""
    assert_off_the_road(waited(straight_scene, (50.0, -5.5, 1.4, 0.0), dt))


def assert_off_the_road(states: Sequence[BodyState]) -> None:
    """No corner of the body is ever on the carriageway."""
    for state in states:
        assert all(abs(y) > -KERB for _, y in corners(state.box)), state


# By a programme -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("walk", "what"),
    [
        ({}, "straight across"),
        ({"heading": -0.9}, "towards the ego"),
        ({"speed": 0.5, "heading": 0.6}, "slowly, with the ego"),
        ({"speed": 0.4, "depth": -0.6}, "comes closer, then steps in"),
        ({"depth": -0.4, "pause": 1.5}, "stops before the strip"),
        ({"depth": -0.9, "heading_2": math.pi / 2, "length_2": 2.0}, "along the lane, then in"),
        ({"speed": 0.6, "depth": -0.5, "resume": 0.5}, "waits for the ego before the strip"),
    ],
)
@pytest.mark.parametrize("zone", [0.0, 0.8])
def test_a_programme_enters_the_strip_at_its_zone(
    straight_scene: MakeScene, walk: dict[str, float], what: str, zone: float
) -> None:
    """By whichever of its legs, an ego that keeps its speed is then as far away as it says."""
    scene = straight_scene([(75.0, SOUTH, 0.0)])
    programme = WalkProgramme(zone, 1.4, 0.0, 3.0, 0.0, None, 1.3, 0.0, 5.0, 0.0)
    programme = programme._replace(**walk)
    if programme.resume is not None:
        programme = programme._replace(cue=1.6, resume=zone)
    agent = SearchAgent()
    agent.remember({"starts": [], "programmes": [programme._asdict()]})
    start = scene.starts[0]
    first, ego = (start.x, start.y, 0.0, start.o), (2.25, LANE, SPEED, 0.0)
    for snapshot in played(scene, agent, first, ego, 94.0 / SPEED):
        driver, body = snapshot.ego, snapshot.testers[0]
        inside = [x for x, y in corners(body.box) if abs(y - LANE) < driver.body.kind.width / 2]
        if inside:
            gap = min(inside) - driver.x - driver.body.kind.length / 2
            braking, reaction = 0.5 * SPEED * SPEED / 9.0, 0.675 * SPEED
            assert gap == pytest.approx(braking + zone * reaction, abs=0.45 * SPEED), what
            return
    pytest.fail(f"{what}: never entered the strip")


# By an exposure -----------------------------------------------------------------------------------


def stepped_off(scene: Scene, lights: str = "", **walker: object) -> float | None:
    """How many seconds the ego has left as a pedestrian is on the road; None if it stays."""
    programme = WalkProgramme(0.0, 1.2, 0.0, 0.0, 0.0, None, 1.2, 0.0, 0.0, 0.0)
    given = {"arrival_s": 4.0, "accepts": True, "complies": True, **walker}
    agent = ExposureAgent()
    agent.remember({"starts": [], "walkers": [{**given, "programme": list(programme)}]})
    start, ego = scene.starts[0], (2.25, LANE, SPEED, 0.0)
    frames = played(scene, agent, (start.x, start.y, 0.0, start.o), ego, 94.0 / SPEED, lights)
    for snapshot in frames:
        body = snapshot.testers[0]
        if max(y for _, y in corners(body.box)) > KERB:
            ahead = start.x - snapshot.ego.x - scene.ego.kind.length / 2 - body.body.kind.width / 2
            return ahead / SPEED
    return None


@pytest.mark.parametrize("arrival", [3.0, 6.0])
def test_a_pedestrian_of_an_exposure_decides_as_it_arrives(
    straight_scene: MakeScene, arrival: float
) -> None:
    """The ego then has so much time left; who does not accept it stays for good."""
    scene = straight_scene([(75.0, SOUTH, 0.0)])
    left = stepped_off(scene, arrival_s=arrival)
    assert left == pytest.approx(arrival - 0.8, abs=0.4)  # it has to gain speed
    assert stepped_off(scene, arrival_s=arrival, accepts=False) is None


@pytest.mark.parametrize(
    ("light", "accepts", "complies", "goes"),
    [
        ("G", False, True, True),
        ("r", True, True, False),
        ("r", True, False, True),
        ("r", False, False, False),
    ],
)
def test_a_light_decides_for_those_who_comply(
    straight_scene: MakeScene, light: str, accepts: bool, complies: bool, goes: bool
) -> None:
    """At green everybody goes, at red those who do not comply and accept the gap."""
    scene = straight_scene([(75.0, SOUTH, 0.0)])
    here = MarkedCrossing("c", 70.0, 80.0, box(70, -4, 80, 4), ("light", 0), False)
    scene = dataclasses.replace(scene, crossings=(here,))
    assert (stepped_off(scene, light, accepts=accepts, complies=complies) is not None) is goes
