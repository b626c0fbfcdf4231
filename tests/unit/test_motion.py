"""Motions and ways in closed form, against integration in small steps and known curves."""

from __future__ import annotations

import math

import pytest

from cavsumo.model.curve import Bend, PlaneCurve
from cavsumo.model.motion import Motion, Phase, motion_of, to_speed_by, to_speed_over

MOTION = motion_of(2.0, [to_speed_over(2.0, 6.0, 8.0), Phase(0.0, 1.5), to_speed_by(6.0, 0.0, 3.0)])


def test_a_motion_is_the_integral_of_its_phases() -> None:
    """Distance and speed agree with a sum over small steps, at every time."""
    dt, s, time = 1e-4, 0.0, 0.0
    while time < 6.0:
        there, v = MOTION.at(time)
        assert there == pytest.approx(s, abs=1e-3)
        s, time = s + dt * (v + MOTION.at(time + dt)[1]) / 2, time + dt
    assert MOTION.at(0.0) == (0.0, 2.0)
    assert MOTION.at(2.0) == pytest.approx((8.0, 6.0))
    assert MOTION.at(100.0) == pytest.approx((23.0, 0.0))
    assert MOTION.top_speed == pytest.approx(6.0)


@pytest.mark.parametrize("distance", [0.0, 0.5, 8.0, 12.0, 20.0, 22.9])
def test_the_time_of_a_place_is_the_inverse(distance: float) -> None:
    """``when`` undoes ``at``; a place that is never reached has an infinite time."""
    assert MOTION.at(MOTION.when(distance))[0] == pytest.approx(distance)
    assert MOTION.when(23.5) == math.inf


def test_before_it_begins_and_after_it_ends_the_speed_is_constant() -> None:
    """Also without any phase."""
    assert MOTION.at(-1.0) == (-2.0, 2.0)
    assert Motion(3.0).at(2.0) == (6.0, 3.0)
    assert Motion(3.0).when(6.0) == 2.0
    assert Motion(0.0).when(1.0) == math.inf


def test_an_arc_is_a_circle() -> None:
    """A quarter of a circle of 9 m, and straight on before and after it."""
    curve = PlaneCurve((0.0, 0.0, 0.0), [Bend(9.0 * math.pi / 2, 1 / 9.0, 1 / 9.0)])
    assert curve.at(-5.0) == pytest.approx((-5.0, 0.0, 0.0))
    assert curve.at(curve.length) == pytest.approx((9.0, 9.0, math.pi / 2))
    assert curve.at(curve.length + 2.0) == pytest.approx((9.0, 11.0, math.pi / 2))


def test_a_way_by_points_is_straight_between_them() -> None:
    """It passes through the points of the smooth way, and its heading changes evenly."""
    legs = [Bend(3.0, 0.0, 0.0), Bend(6.0, 0.0, 1 / 9.0)]
    smooth = PlaneCurve((0.0, 0.0, 0.0), legs)
    pointed = PlaneCurve((0.0, 0.0, 0.0), legs, 1.0)
    before, after = smooth.at(7.0), smooth.at(8.0)
    assert pointed.at(7.0) == pytest.approx(before)
    middle = [(a + b) / 2 for a, b in zip(before, after, strict=True)]
    assert pointed.at(7.5) == pytest.approx(middle)
    assert pointed.at(20.0) == smooth.at(20.0)


def test_a_clothoid_is_the_integral_of_its_curvature() -> None:
    """Against a sum over small steps; its polyline has its length."""
    curve = PlaneCurve((1.0, 2.0, 0.3), [Bend(6.0, 0.0, 1 / 9.0), Bend(6.0, 1 / 9.0, 0.0)])
    x, y, o, steps = 1.0, 2.0, 0.3, 60_000
    for i in range(steps):
        u = (i + 0.5) * 12.0 / steps
        o += 12.0 / steps * (min(u, 12.0 - u) / 6.0) / 9.0
        x, y = x + 12.0 / steps * math.cos(o), y + 12.0 / steps * math.sin(o)
    assert curve.at(12.0) == pytest.approx((x, y, o), abs=1e-3)
    assert curve.polyline(-3.0, 14.0).length == pytest.approx(17.0, abs=1e-3)
