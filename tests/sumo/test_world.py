"""The boundary to SUMO, against real SUMO: everybody is where SUMO says, to 1e-6."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import libsumo
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cavsumo.egos import Acceleration
from cavsumo.model.bodies import KINDS, PEDESTRIAN, Body, Kind
from cavsumo.model.carriageway import Start
from cavsumo.model.kinematics import wrap
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.sumo.options import OPTIONS
from cavsumo.sumo.poses import from_sumo, to_sumo
from cavsumo.sumo.world import World

Opener = Callable[..., World]
EXACT = 1e-6  # m, rad
TURNS = [math.pi * i / 4 for i in range(-3, 5)]  # rad
PARKED = {"ego": "constant", "ego_params": {"speed": 0.0}}
STAY = Acceleration(0.0)


def standing(x: float, y: float, o: float, kind: Kind = PEDESTRIAN, i: int = 0) -> BodyState:
    """A standing tester."""
    return BodyState(Body(f"tester{i}", kind), x, y, 0.0, o)


def begin(world: World, states: Sequence[BodyState], walk: tuple[str, ...] = ()) -> Snapshot:
    """The first snapshot of an episode with the testers where they stand."""
    return world.reset(1, states, [Start(s.x, s.y, s.o, walk=walk) for s in states])


def episode(world: World, states: tuple[BodyState, ...] = ()) -> Iterator[Snapshot]:
    """What is seen while SUMO drives the ego, until it has arrived."""
    snapshot: Snapshot | None = begin(world, states)
    while snapshot is not None:
        yield snapshot
        snapshot = world.step(states, None)


def in_sumo(domain: Any, state: BodyState) -> tuple[float, float, float]:
    """Where SUMO has a body: its centre and heading, by this test's own arithmetic."""
    (x, y), compass = domain.getPosition(state.id), math.radians(domain.getAngle(state.id))
    half = domain.getLength(state.id) / 2
    east, north = math.sin(compass), math.cos(compass)
    return x - half * east, y - half * north, math.atan2(north, east)


def off_by(place: tuple[float, float, float], state: BodyState) -> float:
    """The largest difference between a place and a state [m or rad]."""
    x, y, o = place
    return max(math.dist((x, y), (state.x, state.y)), abs(wrap(o - state.o)))


@given(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5), st.floats(-10, 10), st.floats(0.1, 30))
def test_a_pose_survives_the_way_to_sumo_and_back(x: float, y: float, o: float, n: float) -> None:
    """Converted to SUMO's conventions and back, a box is where it was."""
    x1, y1, o1 = from_sumo(*to_sumo(x, y, o, n), n)
    assert math.dist((x, y), (x1, y1)) < EXACT
    assert abs(wrap(o1 - o)) < 1e-9
    assert -math.pi < o1 <= math.pi


@given(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5), st.floats(0, 359.999), st.floats(0.1, 30))
def test_sumos_pose_survives_the_way_here_and_back(x: float, y: float, a: float, n: float) -> None:
    """The other way round: a front edge and a compass angle come back."""
    x1, y1, a1 = to_sumo(*from_sumo(x, y, a, n), n)
    assert math.dist((x, y), (x1, y1)) < EXACT
    assert abs((a1 - a + 180.0) % 360.0 - 180.0) < 1e-9
    assert 0.0 <= a1 <= 360.0


@pytest.mark.parametrize(
    ("o", "front"),
    [
        (0.0, (12.0, 20.0, 90.0)),
        (math.pi / 2, (10.0, 22.0, 0.0)),
        (math.pi, (8.0, 20.0, 270.0)),
        (-math.pi / 2, (10.0, 18.0, 180.0)),
    ],
    ids=["east", "north", "west", "south"],
)
def test_the_front_and_the_compass_by_hand(o: float, front: tuple[float, ...]) -> None:
    """A box 4 m long around (10, 20) has its front 2 m ahead; SUMO counts degrees from north."""
    assert to_sumo(10.0, 20.0, o, 4.0) == pytest.approx(front)


@pytest.mark.parametrize("name", ["pedestrians", "crossing", "junction"])
def test_a_tester_is_where_it_was_put(open_world: Opener, name: str) -> None:
    """On roads, crossings, pavements and fields, facing anywhere, SUMO has bodies in place."""
    with open_world(name, testers=len(KINDS), **PARKED) as world:
        places = _places(world)
        fleet = [standing(-50.0 * i, -90.0, 0.0, kind, i) for i, kind in enumerate(KINDS.values())]
        begin(world, fleet)
        for i, (x, y) in enumerate(places * len(TURNS)):
            o, v = TURNS[i // len(places)], 0.3 * (i % 4)
            states = tuple(s._replace(x=x + 20 * j, y=y, v=v, o=o) for j, s in enumerate(fleet))
            world.step(states, STAY)
            assert max(off_by(in_sumo(libsumo.vehicle, s), s) for s in states) < EXACT


def _places(world: World) -> list[tuple[float, float]]:
    """Points on the ego's path, beside it, far away, and on each marked crossing."""
    path, crossings = world.site.route.path, world.site.crossings
    road = [path.at(path.length * share)[:2] for share in (0.3, 0.5, 0.7, 0.9)]
    beside = [(x + 7.0, y - 4.0) for x, y in road]
    marked = [part.representative_point() for part in getattr(crossings, "geoms", [])]
    return [*road, *beside, (-300.0, 900.0), *((p.x, p.y) for p in marked)]


def test_a_person_is_where_it_was_put_between_junctions(open_world: Opener) -> None:
    """Shown to SUMO as a person, a jaywalker is in place at every step of the way across."""
    with open_world(embodiment="person", **PARKED) as world:
        walker = standing(50.0, -5.0, 0.0)
        begin(world, [walker], ("eastbound", "westbound"))
        for i in range(160):
            state = walker._replace(x=50.0 + 0.03 * i, y=-5.0 + 0.07 * i, v=0.76, o=1.1659)
            world.step((state,), STAY)
            assert off_by(in_sumo(libsumo.person, state), state) < EXACT


def test_only_pedestrians_are_shown_as_persons(open_world: Opener) -> None:
    """A tester's car stays a vehicle when the embodiment is person, and is where it was put."""
    with open_world(embodiment="person", kind="car", **PARKED) as world:
        car = standing(50.0, 1.8, math.pi, KINDS["car"])
        begin(world, [car])
        world.step((car,), STAY)
        assert off_by(in_sumo(libsumo.vehicle, car), car) < EXACT
        assert libsumo.person.getIDList() == ()


@pytest.mark.parametrize("name", ["pedestrians", "crossing", "junction"])
def test_the_ego_lies_along_its_lane(open_world: Opener, name: str) -> None:
    """The ego's centre is half its length behind the point of the lane its front has reached."""
    checked = 0
    with open_world(name) as world:
        for snapshot in episode(world):
            lane, along = libsumo.vehicle.getLaneID("ego"), libsumo.vehicle.getLanePosition("ego")
            if along > 4.5:  # else its rear is still on another lane
                assert off_by(_lying(lane, along, 4.5), snapshot.ego) < EXACT
                assert snapshot.ego.v == libsumo.vehicle.getSpeed("ego")
                checked += 1
    assert checked > 50


def _lying(lane: str, along: float, length: float) -> tuple[float, float, float]:
    """Centre and heading of a vehicle on a lane, from SUMO's geometry of the lane."""
    edge, _, index = lane.rpartition("_")
    fx, fy = libsumo.simulation.convert2D(edge, along, int(index))
    rx, ry = libsumo.simulation.convert2D(edge, along - length, int(index))
    o = math.atan2(fy - ry, fx - rx)
    return fx - length / 2 * math.cos(o), fy - length / 2 * math.sin(o), o


TRAFFIC = """<routes>
    <vType id="van" vClass="passenger" length="5.5" width="1.9"/>
    <vType id="stout" vClass="pedestrian" length="0.4" width="0.6"/>
    <vehicle id="car" type="van" depart="0.0" departPos="10.0" departSpeed="5.0">
        <route edges="eastbound"/>
    </vehicle>
    <person id="man" type="stout" depart="0.0" departPos="20.0"><walk edges="eastbound"/></person>
</routes>
"""


@pytest.mark.parametrize("quarters", [0, 1, 2, 3], ids=["east", "north", "west", "south"])
def test_traffic_is_seen_behind_its_fronts(
    open_world: Opener, networks: dict[str, Path], tmp_path: Path, quarters: int
) -> None:
    """A car and a person going in any direction: centre, heading, size and speed by hand."""
    net, routes = tmp_path / "turned.net.xml", tmp_path / "turned.rou.xml"
    _write_turned(networks["pedestrians"], net, quarters)
    routes.write_text(TRAFFIC, encoding="utf-8")
    heading = wrap(quarters * math.pi / 2)
    with open_world(net=net, routes=routes, ego_route=["westbound"]) as world:
        for _, snapshot in zip(range(40), episode(world), strict=False):
            seen = {state.id: state for state in snapshot.background}
        for domain, state, length, width, lane in (
            (libsumo.vehicle, seen["car"], 5.5, 1.9, -1.825),
            (libsumo.person, seen["man"], 0.4, 0.6, None),
        ):
            along = domain.getLanePosition(state.id) - length / 2
            across = state.y * math.cos(heading) - state.x * math.sin(heading)
            across = lane or across  # a person may walk anywhere on its pavement
            place = _turned(along, across, quarters)
            assert off_by((*place, heading), state) < EXACT
            assert (state.body.kind.length, state.body.kind.width) == (length, width)
            assert state.v == domain.getSpeed(state.id) > 0.5


def _turned(x: float, y: float, quarters: int) -> tuple[float, float]:
    """A point turned about the origin by quarter turns to the left."""
    for _ in range(quarters):
        x, y = -y, x
    return x, y


def _write_turned(source: Path, target: Path, quarters: int) -> None:
    """Write a network with every point turned, so that eastbound leads another way."""
    tree = ElementTree.parse(source)
    for element in (*tree.iter("lane"), *tree.iter("junction")):
        points = [tuple(map(float, p.split(","))) for p in element.get("shape", "").split()]
        turned = [_turned(x, y, quarters) for x, y in points]
        element.set("shape", " ".join(f"{x:.3f},{y:.3f}" for x, y in turned))
        if element.tag == "junction":
            place = _turned(float(element.get("x", "")), float(element.get("y", "")), quarters)
            element.set("x", str(place[0]))
            element.set("y", str(place[1]))
    tree.write(target, encoding="utf-8")


def test_the_same_seed_gives_the_same_world_bit_for_bit(open_world: Opener) -> None:
    """Two episodes of one seed in one process, among traffic: no bit of any body differs."""
    with open_world("crossing", routes="auto") as world:
        area = world.site.areas[1]
        bystander = standing(*area.pavement.at(area.begin + 20.0))
        lives = [
            repr(list(zip(range(150), episode(world, (bystander,)), strict=False))) for _ in "ab"
        ]
    assert "bg_car" in lives[0]
    assert "bg_person" in lives[0]
    assert lives[0] == lives[1]


def test_sumo_runs_with_options_fit_for_tests(open_world: Opener) -> None:
    """What SUMO itself says of its options: none of its unsafe defaults is left."""
    with open_world(step_length=0.05) as world:
        world.reset(7, (), ())
        told = {name: libsumo.simulation.getOption(name) for name in OPTIONS}
        assert told == dict(OPTIONS)
        assert libsumo.simulation.getOption("seed") == "7"
        assert libsumo.simulation.getDeltaT() == 0.05
        assert told["collision.action"] == "warn"
        assert told["collision.check-junctions"] == "true"
        assert told["time-to-teleport"] == "-1"
