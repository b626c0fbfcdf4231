"""Programmed vehicles against an ego whose speed is given, without SUMO."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from cavsumo.agents.cues import zone_m
from cavsumo.agents.drive_programme import ProgrammedDrive
from cavsumo.agents.programmed_manoeuvres import DriveProgramme
from cavsumo.egos.base import EGO_KIND
from cavsumo.model.bodies import CAR, Body
from cavsumo.model.carriageway import Approach
from cavsumo.model.kinematics import step_floats
from cavsumo.model.scenario import BatchPlan
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.network.site import Site
from cavsumo.network.vehicle_starts import in_time

DT, REACTION_S = 0.1, 0.675
LIMITS = CAR.wheelbase, CAR.v_min, CAR.v_max, DT
RUN = DriveProgramme(0.5, 8.0, 0.8, None, 0.0, None, 8.0)


@pytest.fixture
def site(staged: Callable[..., tuple[BatchPlan, Site]]) -> Site:
    """Cars at the crossing."""
    return staged("crossing", kind="car")[1]


def driven(
    site: Site, approach: Approach, programme: DriveProgramme, lead: float, speed: float
) -> Iterator[tuple[float, float, BodyState, BodyState]]:
    """Time, arc length of the ego's front, the ego and the vehicle, for half a minute.

    The ego dawdles about a mean speed as SUMO's does, and drives on whoever comes.
    """
    driver, body = Body("ego", EGO_KIND), Body("tester0", CAR)
    start = in_time(approach, CAR, EGO_KIND.length, 0.8, lead).start()
    scene = site.scene(DT, driver, (body,), (start,), 1)
    drive = ProgrammedDrive(scene, 0, programme)
    vehicle = BodyState(body, start.x, start.y, start.v or 0.0, start.o)
    along = 0.0
    for step in range(300):
        v = speed + 0.5 * math.sin(2.0 * step * DT)
        x, y, o = site.route.path.at(along)
        ego = BodyState(driver, x, y, v, o)
        yield step * DT, along + EGO_KIND.length / 2, ego, vehicle
        action = drive.action(Snapshot(step, step * DT, ego, 0.0, (vehicle,)), vehicle)
        vehicle = BodyState(body, *step_floats(*vehicle[1:], *action, *LIMITS))
        along += v * DT


def entered(
    site: Site, approach: Approach, programme: DriveProgramme, lead: float, speed: float = 8.0
) -> tuple[float, float]:
    """When the vehicle comes into the ego's way, and in which zone the ego is then."""
    for time, front, ego, vehicle in driven(site, approach, programme, lead, speed):
        if approach.path.project(vehicle.x, vehicle.y).along >= approach.enter:
            gap = approach.ego_enter - front
            return time, (gap - zone_m(0.0, ego.v)) / (REACTION_S * ego.v)
    raise AssertionError("it never came")


@pytest.fixture
def two_lanes(staged: Callable[..., tuple[BatchPlan, Site]], networks: dict[str, Path]) -> Site:
    """Cars on a road with a lane beside the ego's."""
    road = networks["crossing"].with_name("proving-road.net.xml")
    return staged(kind="car", net=road)[1]


def test_a_vehicle_beside_cuts_in_and_stops(two_lanes: Site) -> None:
    """It keeps its speed beside the ego, changes lanes without stopping, and brakes in the lane."""
    site = two_lanes
    (approach,) = (a for a in site.approaches if a.type == "adjacent")
    programme = RUN._replace(cue=0.5, speed=1.0, depth=0.0, pause=5.0)
    beside, changing, within = list[float](), list[float](), list[float]()
    for *_, vehicle in driven(site, approach, programme, 2.0, 11.0):
        off = abs(site.route.path.project(vehicle.x, vehicle.y).lateral)
        group = beside if off > 3.0 else changing if off > 0.3 else within
        group.append(vehicle.v)
    assert len(beside) > 50
    assert min(beside[:-10]) == pytest.approx(beside[0])
    assert min(changing) >= 0.65 * beside[0]
    assert min(within) == pytest.approx(0.0, abs=0.1)


def test_a_lane_not_yet_beside_the_ego_is_no_place_to_cut_in(two_lanes: Site) -> None:
    """The vehicle drives on to where the lanes run side by side, at its speed."""
    site = two_lanes
    (approach,) = (a for a in site.approaches if a.type == "adjacent")
    later = dataclasses.replace(approach, enter=250.0)
    programme, begun = RUN._replace(cue=20.0, speed=6.0), list[float]()
    for *_, vehicle in driven(site, later, programme, -2.0, 11.0):
        off = abs(site.route.path.project(vehicle.x, vehicle.y).lateral)
        along = later.path.project(vehicle.x, vehicle.y).along
        if off < 3.0:
            begun.append(along)
        elif along < 249.0:
            assert vehicle.v > 5.0
    assert begun[0] > 250.0


def crossing(site: Site) -> list[Approach]:
    """The ways from the side."""
    turns = [
        (a, a.path.at(a.wait)[2] - site.route.path.at(a.ego_enter)[2])
        for a in site.approaches
        if a.type == "crossing"
    ]
    return [a for a, turn in turns if abs(math.sin(turn)) > 0.7]


@pytest.mark.parametrize("lead", [0.5, 2.0, 5.0])
@pytest.mark.parametrize("cue", [0.2, 0.8])
def test_a_vehicle_comes_into_the_way_at_its_cue(site: Site, cue: float, lead: float) -> None:
    """Also after seconds in which the ego's speed changed."""
    ways = crossing(site)
    assert len(ways) >= 2
    for approach in ways:
        _, zone = entered(site, approach, RUN._replace(cue=cue), lead)
        assert zone == pytest.approx(cue, abs=0.8)


@pytest.mark.parametrize("phase", [0.1, 0.6])
def test_a_vehicle_comes_into_the_way_with_its_phase(site: Site, phase: float) -> None:
    """As far from its cue as that needs."""
    for approach in crossing(site):
        programme = RUN._replace(every=1.0, phase=phase)
        time, zone = entered(site, approach, programme, 2.0)
        assert abs(math.remainder(time - phase, 1.0)) <= 0.2
        assert abs(zone - 0.5) < 1.1


def test_a_vehicle_ahead_brakes_though_the_ego_keeps_its_distance(site: Site) -> None:
    """An ego that comes no closer than that is never in the zone of the cue."""
    (approach,) = (a for a in site.approaches if a.type == "following")
    programme = RUN._replace(cue=0.0, speed=1.0)
    slowest = min(v.v for *_, v in driven(site, approach, programme, 1.5, 5.0))
    assert slowest == pytest.approx(1.0, abs=0.3)
