"""How vehicles drive: pure pursuit along arcs and real lanes, speeds, limits, distances."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest

from cavsumo.agents.driving import (
    BRAKING_MPS2,
    KEEP_M,
    LATERAL_MPS2,
    Course,
    speed_limits,
    steer_at,
    stopping_from,
)
from cavsumo.model.bodies import BICYCLE, BUS, CAR, Body, Kind
from cavsumo.model.kinematics import step_floats
from cavsumo.model.polyline import Path
from cavsumo.model.snapshot import BodyState

DT = 0.1


def arc(radius: float, turn: float, straight: float = 40.0) -> Path:
    """A straight, a bend to the left with a radius [m] by an angle [rad], and a straight."""
    count = max(2, math.ceil(abs(turn) * radius))
    bend = [
        (radius * math.sin(a), radius * (1.0 - math.cos(a)))
        for a in (turn * i / count for i in range(count + 1))
    ]
    x, y = bend[-1]
    end = (x + straight * math.cos(turn), y + straight * math.sin(turn))
    return Path([(-straight, 0.0), *bend, end])


def driven(path: Path, kind: Kind, v: float = 5.0, dt: float = DT) -> list[tuple[float, BodyState]]:
    """All states of a body on its way along a path, each with its lateral error [m]."""
    course, body = Course(path, kind, dt, 9.0), Body("tester0", kind)
    x, y, o = path.at(kind.length / 2)
    state, found = BodyState(body, x, y, v, o), []
    for _ in range(round(80 / dt)):
        along, lateral = course.place(state)
        if along > path.length:
            break
        found.append((lateral, state))
        action = course.drive(state, math.inf)
        assert kind.throttle_min <= action.throttle <= kind.throttle_max
        assert abs(action.steering) <= kind.steering_max
        moved = step_floats(*state[1:], *action, kind.wheelbase, kind.v_min, kind.v_max, dt)
        state = BodyState(body, *moved)
    else:
        pytest.fail("did not arrive")
    return found


@pytest.mark.parametrize("radius", [6.0, 8.0, 15.0, 40.0])
@pytest.mark.parametrize("turn", [math.pi / 2, math.pi])
def test_a_car_keeps_to_a_bend(radius: float, turn: float) -> None:
    """Round every bend of a junction the centre stays within 0.3 m of the lane's axis."""
    assert max(abs(error) for error, _ in driven(arc(radius, turn), CAR)) < 0.3


@pytest.mark.parametrize(("kind", "radius"), [(BUS, 60.0), (BICYCLE, 4.0)])
def test_other_kinds_keep_to_bends_that_they_can_turn(kind: Kind, radius: float) -> None:
    """A bus needs a wide bend, a bicycle does not."""
    assert max(abs(error) for error, _ in driven(arc(radius, math.pi / 2), kind)) < 0.3


@pytest.mark.parametrize("dt", [0.02, 0.1, 0.25])
def test_the_timestep_does_not_matter(dt: float) -> None:
    """Fine or coarse, the steering is stable."""
    assert max(abs(error) for error, _ in driven(arc(10.0, math.pi / 2), CAR, dt=dt)) < 0.3


@pytest.mark.parametrize("name", ["crossing", "junction"])
def test_a_car_keeps_to_the_lanes_of_real_junctions(staged: Callable[..., Any], name: str) -> None:
    """Along every approach of the networks that come with cavsumo, turns left and right."""
    approaches = staged(name, kind="car")[1].approaches
    assert len(approaches) > 3
    for approach in approaches:
        assert max(abs(error) for error, _ in driven(approach.path, CAR)) < 0.3


def test_bends_are_driven_slowly_and_braked_for_in_time() -> None:
    """Sideways no more than the limit, lengthwise never harder than the calm brake."""
    states = [state for _, state in driven(arc(10.0, math.pi / 2), CAR, v=9.0)]
    slowest = min(s.v for s in states)
    assert slowest == pytest.approx(math.sqrt(LATERAL_MPS2 * 10.0), rel=0.1)
    braking = [(a.v - b.v) / DT for a, b in pairwise(states)]
    assert max(braking) < BRAKING_MPS2 + 0.5
    assert states[-1].v == pytest.approx(9.0)


def test_speed_limits_foresee_a_bend() -> None:
    """Metre by metre no more than braking brings down, and no more than the top."""
    limits = speed_limits(arc(6.0, math.pi / 2), 9.0)
    assert max(limits) == 9.0
    assert all(v * v <= w * w + 2.0 * BRAKING_MPS2 + 1e-9 for v, w in pairwise(limits))


def test_a_point_straight_ahead_needs_no_steering() -> None:
    """To the left positive, to the right negative, limited everywhere, behind too."""
    state = BodyState(Body("tester0", CAR), 0.0, 0.0, 5.0, 0.0)
    assert steer_at(state, 10.0, 0.0) == 0.0
    assert steer_at(state, 10.0, 1.0) == pytest.approx(-steer_at(state, 10.0, -1.0))
    assert steer_at(state, 10.0, 1.0) > 0.0
    assert steer_at(state, -3.0, 0.1) == CAR.steering_max


def test_the_pursued_point_is_reached_on_one_circle() -> None:
    """With the steering kept, the body's centre passes through the point (the module's formula)."""
    target, state = (8.0, 3.0), (0.0, 0.0, 4.0, 0.0)
    steering = steer_at(BodyState(Body("tester0", CAR), *state), *target)
    nearest = math.inf
    for _ in range(400):
        state = step_floats(*state, 0.0, steering, CAR.wheelbase, 0.0, 9.0, 0.01)
        nearest = min(nearest, math.dist(state[:2], target))
    assert nearest < 0.03


def test_a_vehicle_stops_behind_one_that_stands() -> None:
    """At the distance kept, without a hard brake; who stands beside the lane does not matter."""
    course, body = Course(Path([(0.0, 0.0), (200.0, 0.0)]), CAR, DT, 9.0), Body("tester0", CAR)
    standing = BodyState(Body("other", CAR), 60.0, 0.5, 0.0, 0.0)
    beside = BodyState(Body("beside", CAR), 40.0, 3.2, 0.0, 0.0)
    state = BodyState(body, 5.0, 0.0, 8.0, 0.0)
    for _ in range(300):
        action = course.drive(state, course.room(state, [beside, standing]))
        assert action.throttle > -BRAKING_MPS2 - 0.5
        moved = step_floats(*state[1:], *action, CAR.wheelbase, 0.0, 9.0, DT)
        state = BodyState(body, *moved)
    assert state.v < 0.05
    assert 60.0 - state.x - CAR.length == pytest.approx(KEEP_M, abs=0.3)


def test_time_to_a_place_is_what_the_drive_takes() -> None:
    """The forecast is the drive itself, gaining speed as asked."""
    course, body = Course(arc(10.0, math.pi / 2), CAR, DT, 9.0), Body("tester0", CAR)
    state = BodyState(body, -20.0, 0.0, 0.0, 0.0)
    expected, speed = course.time_to(state, 55.0, 2.5)
    steps = 0
    while course.place(state)[0] < 55.0:
        action = course.drive(state, math.inf, gaining=2.5)
        moved = step_floats(*state[1:], *action, CAR.wheelbase, 0.0, 9.0, DT)
        state, steps = BodyState(body, *moved), steps + 1
    assert steps * DT == pytest.approx(expected, abs=0.3)
    assert state.v == pytest.approx(speed, abs=0.5)


def test_stopping_from_a_distance() -> None:
    """Nothing left: stand; behind who drives ahead one may be faster."""
    assert stopping_from(0.0, 0.0, DT) == stopping_from(-5.0, 0.0, DT) == 0.0
    assert stopping_from(20.0, 8.0, DT) > stopping_from(20.0, 0.0, DT)
    v = stopping_from(20.0, 0.0, DT)
    assert v * DT + v * v / (2.0 * BRAKING_MPS2) == pytest.approx(20.0)
