"""Post-encroachment time by its definition: against shared areas that shapely computes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from cavsumo.assertions.contacts import ContactMonitor
from cavsumo.assertions.criticality import PetAssertion
from cavsumo.assertions.criticality_monitor import CriticalityMonitor
from cavsumo.assertions.metrics import pet_tracks
from cavsumo.model.bodies import CAR, PEDESTRIAN, Body, Kind
from cavsumo.model.snapshot import BodyState, Snapshot

Numbers = NDArray[np.float64]
Motion = Callable[[Numbers], Numbers]  # x, y, heading at these times
SPAN_S, MEETING_S = 16.0, 7.0


def straight(angle: float, speed: float, when: float) -> Motion:
    """Through the origin at a time, along a heading [rad, m/s, s]."""

    def at(t: Numbers) -> Numbers:
        way = speed * (t - when)
        heading = np.full_like(t, angle)
        return np.stack([way * np.cos(angle), way * np.sin(angle), heading], axis=-1)

    return at


def arc(angle: float, speed: float, when: float, radius: float) -> Motion:
    """Through the origin with a heading, on a circle; a negative radius turns right [m]."""

    def at(t: Numbers) -> Numbers:
        heading = angle + speed * (t - when) / radius
        x, y = np.sin(heading) - math.sin(angle), math.cos(angle) - np.cos(heading)
        return np.stack([radius * x, radius * y, heading], axis=-1)

    return at


def tracks(motion: Motion, times: Numbers, size: tuple[float, float]) -> Numbers:
    """The boxes at these times, shape (n, 5)."""
    return np.hstack([motion(times), np.broadcast_to(size, (len(times), 2))])


def outlines(boxes: Numbers) -> Any:
    """The boxes as polygons."""
    x, y, o, length, width = boxes.T
    corners = []
    for along, across in ((1, 1), (-1, 1), (-1, -1), (1, -1)):
        a, b = along * length / 2.0, across * width / 2.0
        corners.append((x + a * np.cos(o) - b * np.sin(o), y + a * np.sin(o) + b * np.cos(o)))
    return shapely.polygons(np.moveaxis(np.array(corners), 2, 0))


def by_areas(first: Numbers, second: Numbers, times: Numbers) -> float:
    """The time between leaving and entering what both sweep, by the outlines at dense times [s]."""
    both = [outlines(first), outlines(second)]
    swept = []
    for boxes in both:
        some = boxes[::10]
        pairs = shapely.union_all(np.stack([some[:-1], some[1:]]), axis=0)
        swept.append(shapely.union_all(shapely.convex_hull(pairs)))
    area = shapely.intersection(*swept)
    assert area.geom_type == "Polygon", "no case of one area"
    shapely.prepare(area)
    inside = [times[shapely.intersects(area, boxes)] for boxes in both]
    return max(0.0, inside[1][0] - inside[0][-1], inside[0][0] - inside[1][-1])


def by_strips(angle: float, sizes: Any, speeds: Any, whens: Any) -> float:
    """The same of straight ways, exactly: by the corners of what two strips have in common [s]."""
    (_, w1), (_, w2) = sizes
    u, v = np.array([1.0, 0.0]), np.array([math.cos(angle), math.sin(angle)])
    n, m = np.array([0.0, 1.0]), np.array([-math.sin(angle), math.cos(angle)])
    corners = [
        np.linalg.solve(np.array([n, m]), (a * w1 / 2.0, b * w2 / 2.0))
        for a, b in itertools.product((-1, 1), repeat=2)
    ]
    spans = []
    for axis, (length, _), speed, when in zip((u, v), sizes, speeds, whens, strict=True):
        along = [float(c @ axis) for c in corners]
        ends = min(along) - length / 2.0, max(along) + length / 2.0
        spans.append([when + end / speed for end in ends])
    return max(0.0, spans[1][0] - spans[0][1], spans[0][0] - spans[1][1])


ANGLES = [30, 45, 60, 75, 90, 120, 135, 150]
CARS = ((4.5, 1.75), (4.5, 1.75))
MIXED = ((4.5, 1.75), (0.65625, 0.875))
DENSE_S = 0.002


@pytest.mark.parametrize("sizes", [CARS, MIXED])
@pytest.mark.parametrize("degrees", [*ANGLES, -30, -100, 15])
def test_straight_ways_of_any_angle(degrees: float, sizes: Any) -> None:
    """Exact whatever the timestep, and whoever comes first."""
    angle = math.radians(degrees)
    for (v, w), late, dt in itertools.product(
        ((4.0, 10.0), (7.3, 5.1), (10.0, 4.0)), (-5.5, 3.3), (0.1, 0.04)
    ):
        times = np.arange(0.0, SPAN_S + 1e-9, dt)
        first = tracks(straight(0.0, v, MEETING_S), times, sizes[0])
        second = tracks(straight(angle, w, MEETING_S + late), times, sizes[1])
        exact = by_strips(angle, sizes, (v, w), (MEETING_S, MEETING_S + late))
        assert pet_tracks(times, first, second) == pytest.approx(exact, abs=1e-9)
        assert pet_tracks(times, second, first) == pytest.approx(exact, abs=1e-9)


@pytest.mark.parametrize("degrees", ANGLES)
def test_the_strips_are_what_the_boxes_sweep(degrees: float) -> None:
    """The two ways to the answer, which know nothing of pieces, agree to their 2 milliseconds."""
    angle, times = math.radians(degrees), np.arange(0.0, SPAN_S, DENSE_S)
    first = tracks(straight(0.0, 8.0, MEETING_S), times, CARS[0])
    second = tracks(straight(angle, 6.0, MEETING_S + 4.0), times, CARS[1])
    exact = by_strips(angle, CARS, (8.0, 6.0), (MEETING_S, MEETING_S + 4.0))
    assert exact > 0.5
    assert by_areas(first, second, times) == pytest.approx(exact, abs=0.003)
    coarse = slice(None, None, 50)
    found = pet_tracks(times[coarse], first[coarse], second[coarse])
    assert found == pytest.approx(exact, abs=1e-9)


@pytest.mark.parametrize("sizes", [CARS, MIXED])
@pytest.mark.parametrize(
    ("degrees", "radius"),
    [(90, 12.0), (90, -12.0), (60, 15.0), (120, -9.0), (45, 25.0), (150, 30.0), (70, 7.0)],
)
def test_ways_that_bend(degrees: float, radius: float, sizes: Any) -> None:
    """A body on a circle across a straight way, as dense outlines have it."""
    times = np.arange(0.0, SPAN_S, DENSE_S)
    turning = arc(math.radians(degrees), 5.0, MEETING_S + 3.5, radius)
    # It comes to stand on the circle before that leads along the other way, and across it again.
    passes = np.clip(times, MEETING_S + 3.5 - 1.3, MEETING_S + 3.5 + 1.3)
    first = tracks(straight(0.0, 8.0, MEETING_S), times, sizes[0])
    second = tracks(turning, passes, sizes[1])
    dense = by_areas(first, second, times)
    assert dense > 0.5
    found = pet_tracks(times[::50], first[::50], second[::50])
    assert found == pytest.approx(dense, abs=0.03)


def snapshots(first: Numbers, second: Numbers, times: Numbers, kinds: Any) -> list[Snapshot]:
    """The ego and a tester; they move, so their speed is not looked at."""
    ego, tester = Body("ego", kinds[0]), Body("tester0", kinds[1])
    return [
        Snapshot(i, float(t), BodyState(ego, *a[:2], 8.0, a[2]), 0.0,
                 (BodyState(tester, *b[:2], 6.0, b[2]),))
        for i, (t, a, b) in enumerate(zip(times, first.tolist(), second.tolist(), strict=True))
    ]  # fmt: skip


@pytest.mark.parametrize("kind", [CAR, PEDESTRIAN])
@pytest.mark.parametrize("degrees", ANGLES)
def test_episodes_and_the_assertion_measure_the_same(degrees: float, kind: Kind) -> None:
    """In an episode, and timestep by timestep: at its end the assertion knows all of the area."""
    angle, times = math.radians(degrees), np.round(np.arange(0.0, SPAN_S, 0.1), 6)
    sizes = (CAR.length, CAR.width), (kind.length, kind.width)
    for late in (-5.0, 4.2):
        first = tracks(straight(0.0, 8.0, MEETING_S), times, sizes[0])
        second = tracks(straight(angle, 6.0, MEETING_S + late), times, sizes[1])
        exact = by_strips(angle, sizes, (8.0, 6.0), (MEETING_S, MEETING_S + late))
        course, monitor, pet = CriticalityMonitor(), ContactMonitor(), PetAssertion(least_s=0.0)
        pet.reset(None)  # type: ignore[arg-type]  # it looks at no scene
        for snapshot in snapshots(first, second, times, (CAR, kind)):
            contacts = monitor.observe(snapshot)
            course.observe(snapshot, contacts)
            pet.observe(snapshot, contacts)
        assert course.extremes().pet == pytest.approx(exact, abs=1e-9)
        assert pet.judgement.robustness == pytest.approx(exact, abs=1e-9)
        assert pet.judgement.verdict == "held"


def test_who_follows_has_no_area_and_comes_to_the_same_places() -> None:
    """Along one way the second comes to each place 3 s after the first has left it, less a step."""
    times = np.round(np.arange(0.0, 10.0, 0.1), 6)
    first = tracks(straight(0.0, 8.0, 4.0), times, CARS[0])
    second = tracks(straight(math.radians(2.0), 8.0, 4.0 + 3.0 + 4.5 / 8.0), times, CARS[1])
    assert pet_tracks(times, first, second) == pytest.approx(3.0, abs=0.11)


def test_who_stands_in_the_area_leaves_it_when_it_drives_on() -> None:
    """It waits in the other's way for four seconds: what counts is when it has driven off."""
    times = np.round(np.arange(0.0, SPAN_S, 0.1), 6)
    waits = np.interp(times, [0.0, 3.0, 7.0, SPAN_S], [0.0, 3.0, 3.0, SPAN_S - 4.0])
    first = tracks(straight(0.0, 6.0, 3.0), waits, CARS[0])
    second = tracks(straight(math.pi / 2, 8.0, 11.0), times, CARS[1])
    leaves = 7.0 + (0.875 + 2.25) / 6.0
    enters = 11.0 - (0.875 + 2.25) / 8.0
    assert pet_tracks(times, first, second) == pytest.approx(enters - leaves, abs=1e-9)
