"""Metrics against vectors with known answers, brute force, and each other."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from support import DATA

from cavsumo.assertions import metrics
from cavsumo.assertions.metrics.encroachment import boxes_overlap
from cavsumo.errors import InputError
from cavsumo.model.geometry import Box, gap, overlap

CASES = json.loads((DATA / "assertion_vectors.json").read_text())["cases"]

angles = st.floats(-math.pi, math.pi)
near = st.floats(-20.0, 20.0)
sizes = st.floats(0.5, 6.0)
boxes = st.tuples(near, near, angles, sizes, sizes)
velocities = st.tuples(st.floats(-10.0, 10.0), st.floats(-10.0, 10.0))


@pytest.mark.parametrize("case", CASES, ids=[case["id"] for case in CASES])
def test_vectors(case: dict[str, Any]) -> None:
    """Every metric gives what is known."""
    agree(getattr(metrics, case["metric"])(**case["input"]), case["expect"])


def agree(found: Any, expected: Any) -> None:
    """Whether a result is the one expected: numbers (also as text), words, lists and tables."""
    if isinstance(expected, dict):
        assert set(found) == set(expected)
        for key, value in expected.items():
            agree(found[key], value)
    elif isinstance(expected, list):
        assert len(found) == len(expected)
        for a, b in zip(found, expected, strict=True):
            agree(a, b)
    else:
        try:
            number = float(expected)
        except ValueError:
            assert found == expected
            return
        assert float(found) == pytest.approx(number, rel=1e-12, abs=1e-12)


def test_metrics_take_arrays() -> None:
    """Arrays broadcast, and each element is what the numbers alone give."""
    gaps, follow, lead = np.array([[20.0], [5.0], [0.0]]), np.array([15.0, 10.0]), 10.0
    for metric in (metrics.ttc_following, metrics.drac):
        found = metric(gaps, follow, lead)
        assert found.shape == (3, 2)
        assert found[1, 0] == metric(5.0, 15.0, 10.0)
    assert metrics.rss_longitudinal(follow, lead, 1.0, 3.5, 4.0, 8.0).shape == (2,)
    both = metrics.ttc_2d_discs([[0, 0], [0, 50]], [10, 0], 1.0, [30, -6], [0, 2], 0.5)
    assert both == pytest.approx([2.85291289864636, math.inf])


@pytest.mark.filterwarnings("error")
def test_what_is_too_long_for_a_float_takes_for_ever() -> None:
    """A closing speed of the smallest float there is: infinite times, and no warning."""
    least = 5e-324
    assert metrics.ttc_following(30.0, least, 0.0) == math.inf
    assert metrics.mttc(30.0, least, 0.0, 0.0, 0.0) == math.inf
    assert (
        metrics.ttc_2d_discs((0.0, 0.0), (least, 0.0), 1.0, (9.0, 0.0), (0.0, 0.0), 1.0) == math.inf
    )
    assert metrics.drac(least, 10.0, 0.0) == math.inf
    assert metrics.mdrac(30.0, least, 0.0, 1.0) == 0.0


def test_the_highway_codes_table() -> None:
    """Rule 126, every row; rule 227 doubles it; a speed that is none is refused."""
    table = {20: (6, 6), 30: (9, 14), 40: (12, 24), 50: (15, 38), 60: (18, 55), 70: (21, 75)}
    for mph, (thinking, braking) in table.items():
        found = metrics.uk_stopping_distance(mph)
        assert (found["thinking_m"], found["braking_m"]) == (thinking, braking)
        assert found["total_m"] == thinking + braking
        wet = metrics.uk_stopping_distance(speed_mps=mph * 0.44704, wet=True)
        assert wet["braking_model_m"] == pytest.approx(2 * found["braking_model_m"])
    for speeds in ({}, {"speed_mph": math.nan}, {"speed_mph": 30, "speed_mps": 14.0}):
        with pytest.raises(InputError, match="mph"):
            metrics.uk_stopping_distance(**speeds)  # type: ignore[arg-type]


@example(30.0, 5e-324, 0.0, 0.0, 0.0)
@given(st.floats(0.1, 100), st.floats(0, 40), st.floats(0, 40), *[st.floats(-8, 8)] * 2)
def test_mttc_is_a_time_at_which_they_meet(
    distance: float, follow: float, lead: float, a: float, b: float
) -> None:
    """The gap is zero then and never before; infinite when it stays open for a minute."""
    time = float(metrics.mttc(distance, follow, lead, a, b))
    ways = np.linspace(0.0, min(time, 60.0), 400)[:-1]
    gaps = distance - (follow - lead) * ways - (a - b) * ways**2 / 2
    assert (gaps > -1e-6 * (1 + distance)).all()
    if time < 1e4:
        at = distance - (follow - lead) * time - (a - b) * time**2 / 2
        scale = distance + abs(follow - lead) * time + abs(a - b) * time**2
        assert at == pytest.approx(0.0, abs=1e-9 * scale)


@settings(deadline=None)
@given(boxes, velocities, boxes, velocities)
def test_boxes_touch_at_their_time_to_collision_and_not_before(
    a: tuple[float, ...], va: tuple[float, float], b: tuple[float, ...], vb: tuple[float, float]
) -> None:
    """Against the boxes themselves, moved along."""
    time = float(metrics.ttc_boxes(a, va, b, vb))
    horizon = min(time, 20.0)
    for t in np.linspace(0.0, horizon, 60)[:-1]:
        if horizon - t > 1e-6:
            assert gap(moved(a, va, t), moved(b, vb, t)) > 0.0
    if time < 20.0:
        assert gap(moved(a, va, time), moved(b, vb, time)) < 1e-6
    assert time == pytest.approx(float(metrics.ttc_boxes(b, vb, a, va)), rel=1e-9, abs=1e-9)


def moved(box: tuple[float, ...], v: tuple[float, float], t: float) -> Box:
    """A box after a while."""
    return Box(box[0] + v[0] * t, box[1] + v[1] * t, *box[2:])


@example(20.0, 10.0, 5.0, 2.2e-311)
@given(st.floats(0.5, 60), st.floats(0, 30), st.floats(0, 30), angles)
def test_behind_one_another_the_plane_is_a_line(
    distance: float, follow: float, lead: float, heading: float
) -> None:
    """Whatever the direction, TTC and DRAC of boxes are those of following."""
    c, s = math.cos(heading), math.sin(heading)
    ahead = distance + (4.5 + 0.7) / 2
    rear, front = (0.0, 0.0, heading, 4.5, 1.8), (ahead * c, ahead * s, heading, 0.7, 0.9)
    pair = (rear, (follow * c, follow * s), front, (lead * c, lead * s))
    near_equal = abs(follow - lead) < 1e-6
    if not near_equal:
        expected = float(metrics.ttc_following(distance, follow, lead))
        assert float(metrics.ttc_boxes(*pair)) == pytest.approx(expected, rel=1e-6)
        needed = float(metrics.drac(distance, follow, lead))
        assert float(metrics.drac_boxes(*pair)) == pytest.approx(needed, rel=1e-6, abs=1e-12)


def test_the_deceleration_for_a_crossing_brings_one_to_stand_at_the_place() -> None:
    """A pedestrian who will be in the way: v^2 / (2 s); one who will not: none."""
    car, walker = (0.0, 0.0, 0.0, 4.0, 2.0), (22.0, -4.5, math.pi / 2, 0.6, 0.8)
    found = metrics.drac_boxes(car, (8.0, 0.0), walker, (0.0, 1.4))
    assert found == pytest.approx(8.0**2 / (2 * (22.0 - 2.0 - 0.4)))
    assert metrics.drac_boxes(car, (8.0, 0.0), walker, (0.0, -1.4)) == 0.0
    assert metrics.drac_boxes(car, (8.0, 0.0), (2.5, 0.0, 0.0, 2.0, 1.0), (0, 0)) == math.inf
    assert metrics.drac_boxes(car, (0.0, 0.0), walker, (0.0, 1.4)) == 0.0


@given(*[st.tuples(near, near)] * 4)
def test_the_closest_approach_is_the_closest(
    p: tuple[float, float], v: tuple[float, float], q: tuple[float, float], w: tuple[float, float]
) -> None:
    """No other time from now on is nearer."""
    time, distance = metrics.closest_approach(p, v, q, w)
    assert time >= 0.0
    for t in np.linspace(0.0, 10.0, 101):
        assert math.dist(at(p, v, t), at(q, w, t)) >= distance - 1e-9


def at(p: tuple[float, float], v: tuple[float, float], t: float) -> tuple[float, float]:
    """A point after a while."""
    return p[0] + v[0] * t, p[1] + v[1] * t


@given(boxes, boxes)
def test_boxes_overlap_as_the_geometry_says(a: tuple[float, ...], b: tuple[float, ...]) -> None:
    """The arrays and the plain floats agree, but for a touch to the last bit."""
    found = bool(boxes_overlap(np.array([a]), np.array([b]))[0])
    if found != overlap(Box(*a), Box(*b)):
        assert gap(Box(*a), Box(*b)) < 1e-9


@pytest.mark.parametrize("lead", [-2.0, -0.5, 0.7, 1.9])
def test_post_encroachment_of_crossing_ways(lead: float) -> None:
    """The car leaves the crossed area 0.5 + ... s before the walker enters it, or after."""
    times = np.arange(0.0, 20.0, 0.02)
    car = np.array([(8.0 * t - 80.0, 0.0, 0.0, 4.0, 2.0) for t in times])
    # The rear of the car leaves x = 0.4 at (80 + 2 + 0.4) / 8 s; the walker's front enters y = -1
    # that much later.
    leaves, enters = (80.0 + 2.0 + 0.4) / 8.0, (80.0 - 2.0 - 0.4) / 8.0
    if lead > 0:
        starts = leaves + lead - (10.0 - 1.0 - 0.3) / 1.5
    else:  # first across: its back leaves y = 1 before the car's front enters x = -0.4
        starts = enters + lead - (10.0 + 1.0 + 0.3) / 1.5
    walker = np.array([(0.0, -10.0 + 1.5 * (t - starts), math.pi / 2, 0.6, 0.8) for t in times])
    found = metrics.pet_tracks(times, car, walker)
    assert found == pytest.approx(abs(lead), abs=0.05)
    assert metrics.pet_tracks(times, walker, car) == pytest.approx(found)


def test_post_encroachment_without_a_shared_place_or_with_a_contact() -> None:
    """Infinite, and zero."""
    times = np.arange(0.0, 5.0, 0.1)
    car = np.array([(8.0 * t, 0.0, 0.0, 4.0, 2.0) for t in times])
    aside = np.add(car, (0.0, 2.5, 0.0, 0.0, 0.0))
    assert metrics.pet_tracks(times, car, aside) == math.inf
    assert metrics.pet_tracks(times, car, np.subtract(aside, (0.0, 1.0, 0.0, 0.0, 0.0))) == 0.0
    assert metrics.pet(12.4, 13.15) == pytest.approx(0.75)
