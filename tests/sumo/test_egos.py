"""The vehicles under test that come with cavsumo, driving in real SUMO."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import libsumo
import pytest

from cavsumo.agents.base import Scene
from cavsumo.egos import EGOS, make_ego
from cavsumo.errors import InputError, UnknownName
from cavsumo.model.bodies import CAR, PEDESTRIAN, Body
from cavsumo.model.carriageway import Start
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.sumo.world import World

Opener = Callable[..., World]
NAMED = [name for name in EGOS if name.startswith("sumo:")]
LANE_Y = -1.825  # of the ego's lane on the straight road [m]


def episode(world: World, *testers: BodyState) -> Iterator[Snapshot]:
    """What is seen while the ego drives past standing testers, for at most 60 s."""
    starts = tuple(Start(t.x, t.y, t.o) for t in testers)
    snapshot: Snapshot | None = world.reset(1, testers, starts)
    assert snapshot is not None
    world.ego.reset(
        Scene(
            dt=world.dt,
            ego=world.ego_body,
            ego_path=world.site.route.path,
            bodies=tuple(t.body for t in testers),
            starts=starts,
            roads=world.site.roads,
        )
    )
    while snapshot is not None and snapshot.time < 60.0:
        yield snapshot
        snapshot = world.step(testers, world.ego.act(snapshot))


def standing(x: float, y: float, o: float = 0.0) -> BodyState:
    """A pedestrian that stands."""
    return BodyState(Body("tester0", PEDESTRIAN), x, y, 0.0, o)


# Constant


@pytest.mark.parametrize("speed", [0.5, 6.75, 13.0])
def test_the_constant_ego_keeps_its_speed(open_world: Opener, speed: float) -> None:
    """From the first to the last timestep, through whoever stands in the way."""
    with open_world(ego="constant", ego_params={"speed": speed}) as world:
        seen = list(episode(world, standing(50.0, LANE_Y)))
    assert max(abs(s.ego.v - speed) for s in seen) < 1e-9
    for a, b in pairwise(seen):
        assert b.ego.x - a.ego.x == pytest.approx(0.1 * speed, abs=1e-9)
        assert b.ego.y == LANE_Y
    assert seen[-1].ego.x > 50.0 or speed == 0.5


def test_the_constant_ego_drives_on_through_a_red_light(open_world: Opener) -> None:
    """It brakes for nobody and no signal: the signalised junction does not slow it."""
    with open_world("junction", ego="constant", ego_params={"speed": 8.0}) as world:
        seen = list(episode(world))
        end = world.site.route.path.length
        assert {round(s.ego.v, 9) for s in seen} == {8.0}
        assert seen[-1].time == pytest.approx(end / 8.0, abs=1.0)
        assert world.teleports == 0


# SUMO's driver


def test_attributes_reach_sumos_vehicle_type(open_world: Opener) -> None:
    """Whatever was asked for is what SUMO says of the ego, and its box here has the same size."""
    asked = {"actionStepLength": 0.5, "length": 6.2, "width": 2.1, "decel": 3.3, "tau": 1.7}
    asked |= {"accel": 1.9, "minGap": 3.5, "emergencyDecel": 7.7}
    with open_world(ego_params=asked) as world:
        first = next(episode(world))
        vehicle = libsumo.vehicle
        assert vehicle.getActionStepLength("ego") == 0.5
        assert (vehicle.getLength("ego"), vehicle.getWidth("ego")) == (6.2, 2.1)
        assert (vehicle.getDecel("ego"), vehicle.getTau("ego")) == (3.3, 1.7)
        assert (vehicle.getAccel("ego"), vehicle.getMinGap("ego")) == (1.9, 3.5)
        assert vehicle.getEmergencyDecel("ego") == 7.7
        assert (first.ego.body.kind.length, first.ego.body.kind.width) == (6.2, 2.1)


def test_the_car_following_model_is_the_one_asked_for(open_world: Opener) -> None:
    """On an empty road Krauss's driver dawdles and IDM's keeps an even speed."""
    changes = {}
    for model in ("Krauss", "IDM"):
        params = {"carFollowModel": model, "actionStepLength": 0.0}
        with open_world(ego_params=params) as world:
            speeds = [s.ego.v for s in episode(world)][:20]
        changes[model] = max(abs(b - a) for a, b in pairwise(speeds))
    assert changes["Krauss"] > 0.02
    assert changes["IDM"] < 1e-3


def test_by_default_the_driver_has_a_reaction_time(open_world: Opener) -> None:
    """SUMO's driver decides once a second by default, in every timestep when told so."""
    asked = {"reaction_s": 0}, {"reaction_s": 0.5}, {"actionStepLength": 0}
    for seconds, params in zip((1.0, 0.1, 0.5, 0.1), ({}, *asked), strict=True):
        with open_world(ego_params=params) as world:
            next(episode(world))
            assert libsumo.vehicle.getActionStepLength("ego") == seconds


@pytest.mark.parametrize(
    ("params", "error", "words"),
    [
        ({"decell": 3.0}, UnknownName, "did you mean 'decel'"),
        ({"carFollowModell": "IDM"}, UnknownName, "did you mean 'carFollowModel'"),
        ({"carFollowModel": "IMD"}, UnknownName, "car-following model 'IMD'; did you mean 'IDM'"),
        ({"carFollowModel": 7}, UnknownName, "unknown car-following model '7'"),
        ({"reaction_s": 11}, InputError, r"reaction_s must lie in \[0, 10\]"),
        ({"reaction_s": 1, "actionStepLength": 1}, InputError, "expected one of them"),
        ({"decel": math.nan}, InputError, "decel must be finite"),
        ({"actionStepLength": -1.0}, InputError, r"actionStepLength must lie in \[0, 10\]"),
        ({"length": math.inf}, InputError, "length must be finite, got inf"),
        ({"width": "wide"}, InputError, "width must be a finite number, got 'wide'"),
        ({"length": 0.0}, InputError, "length must lie in"),
    ],
)
def test_an_attribute_that_sumo_would_swallow_is_refused(
    params: dict[str, Any], error: type[Exception], words: str
) -> None:
    """SUMO ignores unknown attributes without a word; here the nearest one is suggested."""
    with pytest.raises(error, match=words):
        make_ego("sumo", params)


# SUMO's drivers by the name of their model


@pytest.mark.parametrize("ego", NAMED)
def test_the_model_in_the_name_is_in_force(open_world: Opener, tmp_path: Path, ego: str) -> None:
    """SUMO's own state names the model of the ego's type; the driver decides once a second."""
    with open_world(ego=ego) as world:
        next(episode(world))
        libsumo.simulation.saveState(str(tmp_path / "state.xml"))
        types = ElementTree.parse(tmp_path / "state.xml").iter("vType")
        found = {t.get("id"): t.get("carFollowModel") for t in types}
        assert found["cavsumo_ego"] == ego.removeprefix("sumo:")
        assert libsumo.vehicle.getActionStepLength("ego") == 1.0


def test_the_models_drive_differently_and_as_the_attribute_makes_them(open_world: Opener) -> None:
    """Before a standing pedestrian no two models brake alike; carFollowModel is the same driver."""
    driven = {}
    for ego in NAMED:
        model = ego.removeprefix("sumo:")
        for name, params in (ego, {}), ("sumo", {"carFollowModel": model}):
            with open_world(ego=name, ego_params=params) as world:
                driven[name, model] = [s.ego for s in episode(world, standing(90.0, LANE_Y))]
        assert driven[ego, model] == driven["sumo", model]
    speeds = {tuple(state.v for state in states) for states in driven.values()}
    assert len(speeds) == len(NAMED)


@pytest.mark.parametrize("reaction_s", [0.0, 1.0])
@pytest.mark.parametrize("ego", NAMED)
def test_each_model_stops_for_a_tester_on_a_crossing_and_arrives_when_it_is_free(
    open_world: Opener, ego: str, reaction_s: float
) -> None:
    """A pedestrian that stands on the crossing in the ego's lane is not touched."""
    with open_world("crossing", ego=ego, ego_params={"reaction_s": reaction_s}) as world:
        path = world.site.route.path
        crossing = world.site.crossings.centroid
        x, y, o = path.at(path.project(crossing.x, crossing.y).along)
        stopped = list(episode(world, standing(x, y, o + math.pi / 2)))[-1].ego
        assert stopped.v < 0.3
        room = math.hypot(x - stopped.x, y - stopped.y) - (CAR.length + PEDESTRIAN.width) / 2
        assert 0.3 < room < 15.0
        last = list(episode(world, standing(x + 15.0, y + 15.0)))[-1]
        assert last.time < 40.0
        assert path.project(last.ego.x, last.ego.y).along > path.length - 5.0


@pytest.mark.parametrize(
    ("ego", "params", "words"),
    [
        ("sumo:IMD", {}, "unknown ego 'sumo:IMD'; did you mean 'sumo:IDM'"),
        ("sumo:", {}, "unknown ego 'sumo:'; did you mean 'sumo'"),
        ("sumo:IDM", {"carFollowModel": "ACC"}, "ego sumo:IDM: carFollowModel is in the name"),
        ("sumo:ACC", {"decell": 1}, "ego sumo:ACC: .*did you mean 'decel'"),
    ],
)
def test_a_wrong_name_of_a_model_is_refused(ego: str, params: dict[str, Any], words: str) -> None:
    """The nearest name is suggested, and a model that contradicts the name is none."""
    with pytest.raises(InputError, match=words):
        make_ego(ego, params)


# The time-gap follower


def test_the_time_gap_ego_stops_for_a_body_in_its_path(open_world: Opener) -> None:
    """It comes to rest before the pedestrian, near its standstill gap, braking as it likes to."""
    with open_world(ego="time-gap") as world:
        seen = list(episode(world, standing(90.0, LANE_Y, math.pi / 2)))
    last = seen[-1].ego
    gap = (90.0 - PEDESTRIAN.width / 2) - (last.x + last.body.kind.length / 2)
    assert last.v < 0.05
    assert 1.5 < gap < 3.5
    late = [s.ego.v for s in seen if s.ego.x > 40.0]
    assert min(b - a for a, b in pairwise(late)) > -0.1 * 4.5


def test_the_time_gap_ego_is_calm_on_an_empty_road(open_world: Opener) -> None:
    """With nobody there it never brakes harder than it finds comfortable, 3 m/s2."""
    with open_world(ego="time-gap") as world:
        seen = [s.ego.v for s in episode(world)]
    assert min(b - a for a, b in pairwise(seen)) > -0.1 * 3.0


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_time_gap_ego_passes_a_body_beside_its_path(open_world: Opener, side: float) -> None:
    """A pedestrian just outside the watched strip leaves its drive as on an empty road."""
    margin, half = 0.3, PEDESTRIAN.width / 2
    beside = LANE_Y + side * (CAR.width / 2 + margin + half + 0.01)
    with open_world(ego="time-gap") as world:
        alone = [s.ego for s in episode(world)]
        assert [s.ego for s in episode(world, standing(70.0, beside))] == alone
        inside = standing(70.0, LANE_Y + side * (CAR.width / 2 + margin + half - 0.01))
        assert list(episode(world, inside))[-1].ego.v < 0.05


def test_the_time_gap_ego_follows_a_car_at_its_time_gap(open_world: Opener) -> None:
    """Behind a car at 5 m/s it settles at that speed, at the distance that IDM prescribes."""
    with open_world("crossing", ego="time-gap", ego_params={"speed": 13.0}, kind="car") as world:
        path = world.site.route.path
        lead = _on(path, 25.0, 5.0)
        snapshot = world.reset(1, (lead,), (Start(lead.x, lead.y, lead.o),))
        world.ego.reset(Scene(0.1, world.ego_body, path, (lead.body,), ()))
        for i in range(200):
            lead = _on(path, 25.0 + 0.5 * (i + 1), 5.0)
            after = world.step((lead,), world.ego.act(snapshot))
            assert after is not None
            snapshot = after
        gap = 25.0 + 0.5 * 200 - path.project(snapshot.ego.x, snapshot.ego.y).along - CAR.length
        wanted = (2.0 + 5.0 * 1.0) / math.sqrt(1 - (5.0 / 13.0) ** 4)
        assert snapshot.ego.v == pytest.approx(5.0, abs=0.1)
        assert gap == pytest.approx(wanted, abs=0.3)


def _on(path: Any, along: float, v: float) -> BodyState:
    """A car on a path."""
    x, y, o = path.at(along)
    return BodyState(Body("tester0", CAR), x, y, v, o)
