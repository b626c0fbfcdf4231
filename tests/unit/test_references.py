"""The reference drivers: their braking against closed forms, what they perceive, the search."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence

import pytest

from cavsumo.assertions.metrics.rss import rss_longitudinal
from cavsumo.egos.base import EGO_KIND
from cavsumo.egos.reference import REFERENCES, Reference
from cavsumo.egos.reference.encounter import Encounter, encounter, lasting_conflict
from cavsumo.egos.reference.rss import dangerous
from cavsumo.model.bodies import CAR
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot
from cavsumo.simulation.avoidability import latest

G = 9.80665
LANE_Y = -1.825  # of the ego on the straight road [m]
NORTH = math.pi / 2


def driver(name: str) -> Reference:
    return REFERENCES.make(name, {})


def stopping(reference: Reference, v: float, dt: float = 0.001) -> tuple[float, float]:
    """Distance [m] and time [s] to standstill from a speed, in small timesteps."""
    way = time = 0.0
    while v > 0.0:
        after = max(0.0, v + reference.throttle(time, dt, EGO_KIND) * dt)
        way, time, v = way + (v + after) / 2 * dt, time + dt, after
    return way, time


def test_the_ideal_driver_brakes_fully_at_once() -> None:
    """Its way is v^2 / 2b with the ego's own b."""
    way, time = stopping(driver("ideal"), 13.5)
    assert way == pytest.approx(13.5**2 / 18.0, abs=0.01)
    assert time == pytest.approx(1.5, abs=0.002)


def test_the_human_driver_is_that_of_the_regulation() -> None:
    """0.4 s and 0.75 s at full speed, 0.6 s of rising brake, then 0.774 g (UN R157, table 1)."""
    v, full = 15.0, 0.774 * G
    human = driver("human")
    assert human.speed_lost(1.15, EGO_KIND) == 0.0
    assert human.speed_lost(1.75, EGO_KIND) == pytest.approx(full * 0.3)
    assert -human.throttle(1.75, 0.1, EGO_KIND) == pytest.approx(7.5903, abs=1e-3)
    rising = v * 0.6 - full * 0.6**2 / 6
    left = v - full * 0.3
    way, time = stopping(human, v)
    assert way == pytest.approx(v * 1.15 + rising + left**2 / (2 * full), abs=0.02)
    assert time == pytest.approx(1.75 + left / full, abs=0.003)


def test_the_rss_driver_needs_no_more_than_the_safe_distance() -> None:
    """After the response time it brakes with b_min; the safe distance allows for more speed."""
    way, _ = stopping(driver("rss"), 10.0)
    assert way == pytest.approx(10.0 + 10.0**2 / 8.0, abs=0.02)
    assert way < float(rss_longitudinal(10.0, 0.0, 1.0, 3.5, 4.0, 8.0))


@pytest.mark.parametrize("name", list(REFERENCES))
@pytest.mark.parametrize("dt", [0.01, 0.1, 1.0])
def test_the_speed_lost_does_not_depend_on_the_timestep(name: str, dt: float) -> None:
    """The throttle of a timestep is the mean over it, and never a gain."""
    reference = driver(name)
    throttles = [reference.throttle(i * dt, dt, CAR) for i in range(round(4.0 / dt))]
    assert max(throttles) <= 0.0
    assert -sum(throttles) * dt == pytest.approx(reference.speed_lost(4.0, CAR))
    assert reference.words


@pytest.mark.parametrize("name", list(REFERENCES))
def test_no_driver_brakes_harder_than_its_vehicle_can(name: str) -> None:
    """A vehicle with weak brakes stays one."""
    weak = dataclasses.replace(EGO_KIND, throttle_min=-2.0)
    reference = driver(name)
    assert min(reference.throttle(0.1 * i, 0.1, weak) for i in range(60)) >= -2.0 - 1e-9


# What is perceived


@pytest.fixture
def met(
    straight_scene: Callable[..., Scene], scene_snapshot: Callable[..., Snapshot]
) -> Callable[..., Encounter]:
    """Call with the ego's (x, v) and a tester's (x, y, v, o): how they meet."""

    def one(ego: tuple[float, float], tester: tuple[float, float, float, float]) -> Encounter:
        scene = straight_scene([tester[:2] + tester[3:]])
        snapshot = scene_snapshot(scene, ego, [tester])
        return encounter(scene, snapshot, snapshot.testers[0])

    return one


def test_an_encounter_is_measured_along_the_path_and_across_it(
    met: Callable[..., Encounter],
) -> None:
    """A pedestrian who walks north towards the lane, 20 m ahead of the ego's front."""
    found = met((10.0, 8.0), (32.6875, LANE_Y - 2.0, 1.4, NORTH))
    assert found.gap == pytest.approx(20.0)
    assert found.length == pytest.approx(4.5 + 0.875)
    assert found.beside == pytest.approx(2.0 - 0.328125 - 0.875)
    assert found.inward == pytest.approx(1.4)
    assert found.onward == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("tester", "conflict"),
    [
        ((30.0, LANE_Y, 0.0, NORTH), True),  # stands in the lane
        ((30.0, LANE_Y - 1.8, 1.4, NORTH), True),  # on the carriageway, walks in
        ((30.0, LANE_Y - 1.8, 0.0, NORTH), False),  # stands at the edge
        ((30.0, LANE_Y - 1.8, 1.4, -NORTH), False),  # walks away
        ((30.0, LANE_Y - 2.0, 1.4, NORTH), False),  # still on the pavement
        ((90.0, LANE_Y - 1.8, 1.4, NORTH), False),  # has crossed before the ego is there
        ((30.0, LANE_Y + 4.0, 1.4, -NORTH), True),  # comes from the other lane
        ((5.0, LANE_Y, 1.4, 0.0), False),  # behind the ego
        ((40.0, LANE_Y, 9.0, 0.0), False),  # drives away faster
    ],
)
def test_a_conflict_is_a_collision_course_on_the_carriageway(
    met: Callable[..., Encounter], tester: tuple[float, float, float, float], conflict: bool
) -> None:
    """Who keeps its velocity and would then be in the ego's strip while the ego passes."""
    assert met((12.0, 8.0), tester).conflict is conflict


def test_an_ego_that_stands_need_not_set_off(met: Callable[..., Encounter]) -> None:
    """Whoever is in the strip ahead is a conflict to it; who walks out of it is none beside it."""
    assert met((12.0, 0.0), (18.0, LANE_Y, 1.4, NORTH)).conflict
    assert not met((12.0, 0.0), (18.0, LANE_Y - 1.8, 0.0, NORTH)).conflict
    assert not met((12.0, 2.0), (18.0, LANE_Y, 1.4, NORTH)).conflict  # gone before it is there


def test_a_conflict_counts_when_it_lasts(met: Callable[..., Encounter]) -> None:
    """One of 0.3 s is none; the next is, from its beginning; so is one that lasts to the end."""
    yes = met((12.0, 8.0), (30.0, LANE_Y, 0.0, NORTH))
    no = met((12.0, 8.0), (30.0, LANE_Y - 2.0, 0.0, NORTH))
    assert lasting_conflict([no, yes, yes, yes, no, no, *[yes] * 9], 0.1) == 6
    assert lasting_conflict([no, None, yes, no, yes, yes], 0.1) == 4
    assert lasting_conflict([no] * 5, 0.1) is None
    leaving = met((12.0, 8.0), (30.0, LANE_Y, 1.4, NORTH))
    assert leaving.in_way
    assert not leaving.conflict
    assert lasting_conflict([*[leaving] * 9, yes], 0.1) == 0  # in the lane, whatever it promises
    assert lasting_conflict([*[leaving] * 9, *[no] * 5, yes], 0.1) == 14  # it has left
    assert lasting_conflict([*[yes] * 9, *[leaving] * 9, yes], 0.1) == 0  # never out of the lane
    assert lasting_conflict([*[yes] * 9, *[no] * 5], 0.1) is None  # it is over
    assert lasting_conflict([*[yes] * 9, *[no] * 5, *[yes] * 5], 0.1) == 14  # another one
    assert lasting_conflict([no, *[yes] * 5, *[no] * 4, *[yes] * 2], 0.1) == 1  # a short break
    assert driver("human").perceived([no, *[yes] * 6], 0.1) == 1
    assert driver("ideal").perceived([no, *[yes] * 6], 0.1) == 1


@pytest.mark.parametrize(
    ("tester", "in_way"),
    [
        ((30.0, LANE_Y, 1.4, NORTH), True),  # in the strip, however soon it will have left
        ((30.0, LANE_Y - 1.4, 1.4, 0.0), True),  # on the carriageway 9 cm beside it
        ((30.0, LANE_Y - 1.65, 0.0, 0.0), False),  # 34 cm beside it
        ((30.0, LANE_Y + 1.45, 0.0, 0.0), True),  # 14 cm, towards the middle of the road
        ((30.0, LANE_Y - 1.9, 0.0, NORTH), False),  # the pavement
        ((15.0, LANE_Y, 9.0, 0.0), False),  # drives away faster
        ((5.0, LANE_Y, 1.4, 0.0), False),  # behind
    ],
)
def test_whom_the_ego_cannot_pass_is_in_its_way(
    met: Callable[..., Encounter], tester: tuple[float, float, float, float], in_way: bool
) -> None:
    """Ahead, slower, and on the carriageway in the strip or within 0.3 m of it."""
    assert met((12.0, 8.0), tester).in_way is in_way


@pytest.mark.parametrize(
    ("tester", "danger"),
    [
        ((30.0, LANE_Y, 0.0, NORTH), True),
        ((30.0, LANE_Y - 4.0, 1.4, NORTH), True),  # RSS knows no kerb: within 3.2 m, walking in
        ((30.0, LANE_Y - 2.0, 0.0, NORTH), False),
        ((60.0, LANE_Y, 0.0, NORTH), False),  # farther than the safe distance of 26.3 m
        ((45.0, LANE_Y, 9.0, math.pi), True),  # oncoming
        ((40.0, LANE_Y, 9.0, 0.0), False),
        ((5.0, LANE_Y, 9.0, 0.0), False),  # behind: keeps the distance itself
    ],
)
def test_a_situation_is_dangerous_when_neither_distance_is_safe(
    met: Callable[..., Encounter], tester: tuple[float, float, float, float], danger: bool
) -> None:
    """RSS, definitions 3 and 7."""
    found = met((12.0, 8.0), tester)
    assert dangerous(found) is danger
    assert driver("rss").perceived([None, found], 0.1) == (1 if danger else None)
    again = [found, None, found, found]
    assert driver("rss").perceived(again, 0.1) == (2 if danger else None)


# The search for the last chance


@pytest.mark.parametrize("end", [1, 2, 7, 100, 600])
def test_the_search_finds_the_last_chance(end: int) -> None:
    """Wherever it lies and wherever the search begins, with few looks; two for a right guess.

    Where looks run out the last chance lies between what is known.
    """
    for last in {-1, 0, end // 3, end - 2, end - 1} - {-2}:
        for guess in {-1, 0, end // 2, last - 3, last, last + 1, end - 1}:
            if not -1 <= guess < end:
                continue
            asked: list[int] = []
            assert latest(_asked(asked, last), guess, -1, end, 99) == (last, last + 1), guess
            assert all(0 <= step < end for step in asked)
            assert len(asked) == len(set(asked)) <= 5 + math.log2(end + 1)
            if guess == last:
                assert len(asked) <= 2
            few: list[int] = []
            low, high = latest(_asked(few, last), guess, -1, end, 3)
            assert low <= last < high
            assert few == asked[:3]
            low, high = latest(_asked([], last), guess, min(last, 1), end, 99)  # some is known
            assert (low, high) == (last, last + 1)


def _asked(asked: list[int], last: int) -> Callable[[int], bool]:
    """Whether a takeover avoids, noting what was asked."""

    def avoids(step: int) -> bool:
        asked.append(step)
        return step <= last

    return avoids


def test_the_names_of_the_drivers_are_those_of_the_setting() -> None:
    """Scenario files and results use them."""
    names: Sequence[str] = list(REFERENCES)
    assert names == ["human", "ideal", "rss"]
