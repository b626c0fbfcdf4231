"""Walking testers keep out of other bodies: they stop, wait, turn back or go round."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import combinations, pairwise

import numpy as np
import pytest
from shapely.geometry import LineString, box

from cavsumo.agents import AGENTS, Agent
from cavsumo.agents.avoidance import KEEP_M, PATIENCE_S, ROUND_S
from cavsumo.assertions.contacts import depth
from cavsumo.assertions.validity import DEEP_M
from cavsumo.model.bodies import CAR, PEDESTRIAN, Body
from cavsumo.model.carriageway import Roads, Start
from cavsumo.model.geometry import gap
from cavsumo.model.kinematics import step_floats
from cavsumo.model.polyline import Path
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, RawState, Snapshot

DT = 0.1
WEST, NORTH = math.pi, math.pi / 2
PAVEMENT = Path([(0.0, -5.0), (100.0, -5.0)])
# A road 100 m long and 7 m wide, with pavements on both of its sides.
ROADS = Roads(
    box(0.0, -3.5, 100.0, 3.5),
    [LineString([(0, -1.75), (100, -1.75)]), LineString([(100, 1.75), (0, 1.75)])],
    [LineString(PAVEMENT.points), LineString([(0, 5), (100, 5)])],
)
EGO = Body("ego", CAR)
FAR: RawState = (EGO, 1000.0, -1.75, 5.0, 0.0)
Place = tuple[float, float, bool]  # along the pavement [m], to its left [m], forwards


def scene_of(places: Sequence[Place], roads: Roads = ROADS) -> Scene:
    """Pedestrians that start at full speed on the southern pavement."""
    bodies = tuple(Body(f"tester{i}", PEDESTRIAN) for i in range(len(places)))
    starts = tuple(
        Start(x, -5.0 + aside, 0.0 if on else WEST, PAVEMENT, aside, on) for x, aside, on in places
    )
    return Scene(DT, EGO, Path([(0.0, -1.75), (100.0, -1.75)]), bodies, starts, roads)


def played(
    scene: Scene,
    agents: Sequence[Agent],
    seconds: float,
    others: Callable[[float], tuple[RawState, ...]] = lambda time: (),
    ego: Callable[[float], RawState] = lambda time: FAR,
    v: float = PEDESTRIAN.v_max,
) -> Iterator[Snapshot]:
    """What is seen while each agent moves one body."""
    for i, agent in enumerate(agents):
        agent.reset(scene, [i], np.random.default_rng(i))
    type(agents[0]).coordinate(agents, np.random.default_rng(0))
    testers = tuple(
        BodyState(body, start.x, start.y, v, start.o)
        for body, start in zip(scene.bodies, scene.starts, strict=True)
    )
    for step in range(round(seconds / DT) + 1):
        time = step * DT
        snapshot = Snapshot(step, time, BodyState._make(ego(time)), 0.0, testers, others(time))
        yield snapshot
        chosen = [agent.choose_action(snapshot)[0] for agent in agents]
        limits = PEDESTRIAN.wheelbase, PEDESTRIAN.v_min, PEDESTRIAN.v_max, DT
        testers = tuple(
            BodyState(state.body, *step_floats(*state[1:], *action, *limits))
            for state, action in zip(testers, chosen, strict=True)
        )


def deepest(frames: Sequence[Snapshot]) -> float:
    """How deep two testers are in each other at most [m]."""
    return max(depth(a.box, b.box) for frame in frames for a, b in combinations(frame.testers, 2))


def strollers(places: Sequence[Place], seconds: float) -> list[Snapshot]:
    """Testers that walk along their pavement; the ego never comes."""
    agents = [AGENTS.make("proximity", {}) for _ in places]
    return list(played(scene_of(places), agents, seconds))


def test_two_who_meet_stop_and_one_turns_back() -> None:
    """Head-on on one line: they do not touch, the later one turns back, the other one walks on."""
    frames = strollers([(40.0, 0.0, True), (46.0, 0.0, False)], 20.0)
    assert deepest(frames) == 0.0
    met = frames[round(3.0 / DT)].testers
    assert [state.v for state in met] == [0.0, 0.0]
    assert KEEP_M <= gap(met[0].box, met[1].box) < 1.5 * KEEP_M
    first, later = frames[-1].testers
    assert first.x > 55.0
    assert first.v == PEDESTRIAN.v_max
    assert math.cos(later.o) > 0.99  # it faced west
    assert later.x > first.x


def test_who_passes_beside_another_walks_on() -> None:
    """Lines farther apart than a box is wide: nobody stops."""
    frames = strollers([(40.0, -0.45, True), (46.0, 0.45, False)], 5.0)
    assert {state.v for frame in frames for state in frame.testers} == {PEDESTRIAN.v_max}


@pytest.mark.parametrize("seed", range(5))
def test_a_crowd_on_one_pavement(seed: int) -> None:
    """Nobody gets into anybody, and nobody stands for ever in the middle of it."""
    rng = np.random.default_rng(seed)
    places = [
        (12.0 * i + 5.0, float(rng.uniform(-0.45, 0.45)), bool(rng.integers(2))) for i in range(8)
    ]
    frames = strollers(places, 90.0)
    assert deepest(frames) < DEEP_M[2]
    crossed = [f.testers for f in frames[:: round(20.0 / DT)]]
    for i in range(len(places)):
        ends = [min(s[i].x, 100.0 - s[i].x) < 10.0 for s in crossed]
        moved = [a[i][1:3] != b[i][1:3] for a, b in pairwise(crossed)]
        assert all(m or e for m, e in zip(moved, ends[1:], strict=True))


@pytest.mark.parametrize("agent", ["proximity", "timing", "expectiminimax", "best-response"])
def test_who_crosses_goes_round_a_standing_car(agent: str) -> None:
    """A car stands where the way across leads: a tester waits, walks past its end and goes on."""
    car: RawState = (Body("parked", CAR), 50.0, -1.75, 0.0, 0.0)

    def ego(time: float) -> RawState:
        return EGO, 10.0 + 6.0 * time, 1.75, 6.0, 0.0

    agents = [AGENTS.make(agent, {})]
    frames = list(
        played(scene_of([(50.5, 1.0, True)]), agents, 40.0, lambda time: (car,), ego, v=0.0)
    )
    assert max(depth(f.testers[0].box, BodyState._make(car).box) for f in frames) < DEEP_M[1] / 2
    last = frames[-1].testers[0]
    if agent != "best-response":  # trained on nothing it may not walk at all
        assert last.y > 3.5
        left = next(f.time for f in frames if f.testers[0].y > -3.9)
        there = next(f.time for f in frames if f.testers[0].y > 3.5)
        assert PATIENCE_S < there - left < 2.0 * PATIENCE_S + ROUND_S


def test_who_walks_along_waits_for_a_standing_person_and_turns_back() -> None:
    """Somebody of the traffic stands on the pavement for good."""
    person: RawState = (Body("walker", PEDESTRIAN), 50.0, -5.0, 0.0, 0.0)
    agents = [AGENTS.make("election", {})]
    frames = list(played(scene_of([(45.0, 0.0, True)]), agents, 20.0, lambda time: (person,)))
    boxes = [f.testers[0].box for f in frames]
    assert max(depth(one, BodyState._make(person).box) for one in boxes) == 0.0
    assert frames[-1].testers[0].x < 45.0
    stood = sum(f.testers[0].v == 0.0 for f in frames) * DT
    assert PATIENCE_S - 2.0 < stood <= PATIENCE_S  # it waits from when it brakes


def test_nobody_avoids_the_ego_that_moves() -> None:
    """That is the ego's task; before one that stands a tester stops."""

    def furthest(ego_v: float) -> float:
        agents = [AGENTS.make("proximity", {})]
        ego: RawState = (EGO, 50.0, -1.75, ego_v, 0.0)
        frames = played(scene_of([(50.0, 1.0, True)]), agents, 8.0, ego=lambda time: ego, v=0.0)
        return max(f.testers[0].y for f in frames if abs(f.testers[0].x - 50.0) < 1.0)

    assert furthest(1.0) > 0.0
    assert furthest(0.0) < -1.75 - CAR.width / 2


def test_whoever_is_beside_is_waited_for_whether_recorded_or_not() -> None:
    """Farther away than the bodies that every snapshot shows nobody is looked at."""
    near: RawState = (Body("walker", PEDESTRIAN), 46.0, -5.0, 0.0, 0.0)
    fast: RawState = (Body("car", CAR), 60.0, -5.0, 30.0, WEST)
    place = [(45.0, 0.0, True)]

    def speeds(others: tuple[RawState, ...]) -> list[float]:
        agents = [AGENTS.make("proximity", {})]
        frames = played(scene_of(place), agents, 0.2, lambda time: others)
        return [f.testers[0].v for f in frames]

    assert speeds((fast,)) == speeds(())
    assert speeds((near,)) < speeds(())
