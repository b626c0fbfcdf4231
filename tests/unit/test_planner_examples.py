"""The adapters of examples/planners, with planners that are not real: what they read and answer."""

from __future__ import annotations

import dataclasses
import importlib
import json
import math
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest
from support import ROOT

from cavsumo.egos.base import EGO_KIND, Mission
from cavsumo.egos.external import protocol
from cavsumo.model.carriageway import Light
from cavsumo.model.kinematics import step_floats
from cavsumo.model.polyline import Path as Polyline
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot
from cavsumo.model.surroundings import RouteLane, Surroundings

PLANNERS = ROOT / "examples" / "planners"
NAMES = ("common", "fiss", "frenet", "highway", "reactive")
BEND = Polyline([(0.0, -1.825), (50.0, -1.825), (50.0, 40.0)])
LANES = RouteLane(0.0, 3.65, 13.9), RouteLane(50.0, 3.2, 8.0)
WALKER, BESIDE = (40.0, -2.0, 1.4, math.pi / 2), (30.0, -5.0, 1.4, 0.0)  # x, y, speed, heading


@pytest.fixture
def planners(monkeypatch: pytest.MonkeyPatch) -> Iterator[SimpleNamespace]:
    """The modules of the examples."""
    monkeypatch.syspath_prepend(str(PLANNERS))
    yield SimpleNamespace(**{name: importlib.import_module(name) for name in NAMES})
    for name in NAMES:
        sys.modules.pop(name, None)


@pytest.fixture
def see(
    planners: SimpleNamespace,
    straight_scene: Callable[..., Scene],
    scene_snapshot: Callable[..., Snapshot],
) -> Callable[..., Any]:
    """Call with the ego (x, speed) and the light's letter for what a planner sees."""
    made = straight_scene(((60.0, -5.15, 0.0), (60.0, -5.15, 0.0)))
    scene = dataclasses.replace(made, ego_path=BEND, lights=(Light("J", 0, 35.0),))
    surroundings = Surroundings(LANES)
    mission = Mission(
        Path("x.net.xml"), ("a",), BEND, scene.lights, 0.1, 60.0, surroundings=surroundings
    )
    road = planners.common.Road(json.loads(protocol.hello(mission, EGO_KIND)))
    lines = protocol.Observations(scene)

    def seen(x: float = 10.0, v: float = 8.0, letter: str = "G", step: int = 0) -> Any:
        shown = scene_snapshot(scene, (x, v), [WALKER, BESIDE], step=step)
        message = json.loads(lines.line(shown._replace(lights=(letter,))))
        return planners.common.Seen(road, message)

    return seen


# The shared module --------------------------------------------------------------------------------


def test_the_road_is_the_route(see: Callable[..., Any]) -> None:
    """The centre line by arc length, and the lowest speed limit of the next second."""
    road = see().road
    for along in (-5.0, 0.0, 20.0, 49.0, 60.0, 95.0):
        assert road.at(along) == pytest.approx(BEND.at(along))
    assert (road.width, road.length) == (3.2, pytest.approx(BEND.length))
    assert see(10.0).speed_limit == 13.9
    assert see(44.0).speed_limit == 8.0


def test_a_wall_stands_behind_the_stop_line_of_a_red_light(see: Callable[..., Any]) -> None:
    """1 m behind it; a planner sees nothing at a green light, or after the line."""
    walls = [see(10.0, letter=letter).obstacles[2:] for letter in "Gry"]
    assert [len(found) for found in walls] == [0, 1, 1]
    wall = walls[1][0]
    assert (wall.x, wall.y, wall.speed) == pytest.approx((36.0, -1.825, 0.0))
    assert len(see(40.0, letter="r").obstacles) == 2


def test_bodies_are_predicted_with_constant_velocity(see: Callable[..., Any]) -> None:
    """A walker goes on; its number is its place in the list."""
    walker, beside = see().bodies
    assert walker.at(2.0) == pytest.approx((40.0, 0.8))
    assert (walker.number, walker.on_carriageway) == (0, True)
    assert (beside.number, beside.on_carriageway) == (1, False)


def drive(planners: SimpleNamespace, see: Callable[..., Any], decide: Any, steps: int) -> Any:
    """Drive the kinematic bicycle by a controller of (x, y, v, o); the states in order."""
    seen, state, states = see(), (10.0, -1.825, 8.0, 0.0), []
    for _ in range(steps):
        seen.x, seen.y, seen.speed, seen.heading = state
        seen.along = BEND.project(*state[:2]).along
        answer = decide(seen)
        state = step_floats(
            *state, answer["throttle"], answer["steering"], EGO_KIND.wheelbase, 0.0, 55.0, 0.1
        )
        states.append(state)
    return np.array(states)


def test_a_planned_path_is_followed(planners: SimpleNamespace, see: Callable[..., Any]) -> None:
    """A plan on a circle of 20 m at rising speed: within 0.25 m of it, and at its speed."""
    times = np.arange(0.0, 3.0, 0.1)

    def decide(seen: Any) -> Any:
        turned = math.atan2(seen.x - 10.0, 18.175 - seen.y)
        ways = turned + (seen.speed * times + 0.25 * times**2) / 20.0
        xs, ys = 10.0 + 20.0 * np.sin(ways), 18.175 - 20.0 * np.cos(ways)
        return planners.common.follow(seen, times, xs, ys, seen.speed + 0.5 * times)

    states = drive(planners, see, decide, 40)
    radii = np.hypot(states[:, 0] - 10.0, states[:, 1] - 18.175)
    assert abs(radii - 20.0).max() < 0.25
    assert states[-1, 2] == pytest.approx(8.0 + 0.5 * 4.0)


def test_braking_keeps_to_the_centre_line(
    planners: SimpleNamespace, see: Callable[..., Any]
) -> None:
    """From 8 m/s before the bend to a stop, and no harder than the ego can."""
    states = drive(planners, see, lambda seen: planners.common.brake(seen, -2.0), 50)
    assert states[-1, 2] == 0.0
    assert abs(states[:, 1] + 1.825).max() < 0.05
    assert planners.common.brake(see(), -99.0)["throttle"] == EGO_KIND.throttle_min


def test_a_missing_package_is_one_sentence(
    planners: SimpleNamespace, capsys: pytest.CaptureFixture[str]
) -> None:
    """With the command that installs it, and the exit status of wrong input."""
    with pytest.raises(SystemExit) as raised:
        planners.common.package("no_such_planner", "no-such-planner==1.0")
    assert raised.value.code == 2
    assert capsys.readouterr().err == (
        "this planner needs a package: pip install no-such-planner==1.0\n"
    )


@pytest.mark.parametrize("name", NAMES[1:])
def test_an_adapter_is_short(name: str) -> None:
    """Below 80 lines."""
    assert len((PLANNERS / f"{name}.py").read_text(encoding="utf-8").splitlines()) < 80


# The adapters with fake planners ------------------------------------------------------------------


@pytest.mark.parametrize(
    ("emergency", "answer"),
    [(False, {"throttle": -1.5, "steering": 0.1}), (True, {"throttle": -8.0, "steering": 0.0})],
)
def test_fiss(
    planners: SimpleNamespace, see: Callable[..., Any], emergency: bool, answer: dict[str, float]
) -> None:
    """The command of its own controller, or hard braking where it wants an emergency stop."""
    fp = MagicMock()
    step = fp.LocalPlanner.return_value.step
    step.return_value.configure_mock(emergency=emergency, success=not emergency)
    command = SimpleNamespace(accel=-1.5, steer=0.1)
    fp.StanleyPidController.return_value.compute.return_value = command
    seen = see()
    assert planners.fiss.begin(fp, seen.road)(seen) == pytest.approx(answer, abs=1e-9)
    time, _, others, speed = step.call_args.args
    assert (time, len(others), speed) == (0.0, 2, 13.9)
    assert fp.EgoState.call_args.args == (10.0, -1.825, 0.0, 8.0, 0.0)
    predicted = [call.args[:5] for call in fp.predict_constant_velocity.call_args_list]
    assert predicted == [(0, 40.0, -2.0, math.pi / 2, 1.4), (1, 30.0, -5.0, 0.0, 1.4)]


def test_highway(planners: SimpleNamespace, see: Callable[..., Any]) -> None:
    """Its vehicle decides among the bodies on the carriageway; the answer is in the limits."""
    package = MagicMock()
    ego = package.behavior.IDMVehicle.return_value
    ego.action = {"acceleration": np.float64(-1.25)}
    seen = see()
    plan = planners.highway.begin(package, seen.road)
    assert plan(seen) == {"acceleration": -1.25}
    place = package.road.Road.return_value
    assert place.vehicles == [ego, package.kinematics.Vehicle.return_value]
    assert package.kinematics.Vehicle.call_args.args == (place, (40.0, -2.0), math.pi / 2, 1.4)
    ego.action = {"acceleration": np.float64(-20.0)}
    assert plan(seen) == {"acceleration": -9.0}


def test_frenet(planners: SimpleNamespace, see: Callable[..., Any]) -> None:
    """The cheapest feasible trajectory is followed; without one the ego brakes."""
    fx = MagicMock()
    fx.compute_initial_state.return_value = SimpleNamespace(x0_lon=(70, 8, 0), x0_lat=(0, 0, 0))
    times = np.arange(0.0, 3.0, 0.1)
    ahead = SimpleNamespace(x=8.5 + 8.0 * times, y=-1.825 + 0.0 * times, v=8.0 - 2.0 * times)
    samples = [
        SimpleNamespace(feasible=False, valid=True, cartesian=None),
        SimpleNamespace(feasible=True, valid=True, cartesian=ahead),
    ]
    handler = fx.TrajectoryHandler.return_value
    seen = see()
    plan = planners.frenet.begin(fx, np, seen.road)
    handler.get_sorted_trajectories.return_value = samples
    assert plan(seen) == pytest.approx({"throttle": -2.0, "steering": 0.0}, abs=1e-9)
    places = [call.args[0] for call in fx.PoseWithCovariance.call_args_list]
    assert places[9] == pytest.approx([40.0, -2.0 + 1.4 * 1.0, 0.0])  # the walker after 1 s
    handler.get_sorted_trajectories.return_value = samples[:1]
    assert plan(seen) == pytest.approx({"throttle": -8.0, "steering": 0.0}, abs=1e-9)


def test_reactive(
    planners: SimpleNamespace, see: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A plan is followed for three timesteps; without one the ego brakes and plans at once."""
    monkeypatch.setattr(planners.reactive, "package", MagicMock())
    rp = MagicMock()
    planner = rp.ReactivePlanner.return_value
    states = [
        SimpleNamespace(position=(8.5 + 0.8 * i, -1.825), velocity=8.0 - 0.1 * i) for i in range(40)
    ]
    planner.plan.return_value = (SimpleNamespace(state_list=states), [], [])
    plan = planners.reactive.begin(rp, np, see().road)
    for step, throttle in enumerate((-1.0, -1.0, -1.0, 2.0)):  # the last is that of a new plan
        answer = plan(see(10.0 + 0.8 * step, 8.0 - 0.1 * step, step=step))
        assert answer["throttle"] == pytest.approx(throttle)
    assert planner.plan.call_count == 2
    assert rp.ReactivePlannerState.call_args.kwargs["position"] == pytest.approx([10.9, -1.825])
    planner.plan.return_value = None
    for step in (6, 7):
        assert plan(see(step=step))["throttle"] == -8.0
    assert planner.plan.call_count == 4
