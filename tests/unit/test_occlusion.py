"""Who stands behind whom: hand-made scenes, and random ones against another library's geometry."""

from __future__ import annotations

import math
import random

import pytest
from shapely import LineString, Polygon

from cavsumo.model.geometry import Box, corners
from cavsumo.model.occlusion import in_sight

EYE = (0.0, 0.0)
PERSON = Box(20.0, 0.0, 0.3, 0.66, 0.88)


def sees(*boxes: Box, hiding: bool = True) -> list[bool]:
    """Who of the boxes is seen, when all but the first hide others."""
    return in_sight(EYE, boxes, [False] + [hiding] * (len(boxes) - 1))


@pytest.mark.parametrize(
    ("vehicle", "seen"),
    [
        (Box(10.0, 0.0, math.pi / 2, 4.5, 1.8), False),  # across the line of sight
        (Box(10.0, 0.0, 0.0, 4.5, 1.8), False),  # along it
        (Box(10.0, 3.0, 0.0, 4.5, 1.8), True),  # beside it
        (Box(30.0, 0.0, 0.0, 4.5, 1.8), True),  # behind the person
        (Box(-10.0, 0.0, 0.0, 4.5, 1.8), True),  # behind the eye
        (Box(10.0, 2.1, math.pi / 2, 4.5, 1.8), True),  # all but a corner is covered
        (Box(10.0, 2.5, math.pi / 2, 4.5, 1.8), True),  # the person shows more than half
        (Box(0.5, 0.0, 0.0, 4.5, 1.8), True),  # the eye is inside: it hides nobody
        (Box(20.0, 0.0, 0.0, 4.5, 1.8), False),  # the person is under it
    ],
)
def test_a_vehicle_hides_a_person(vehicle: Box, seen: bool) -> None:
    """Only from between, and only one who shows neither centre nor corner."""
    assert sees(PERSON, vehicle) == [seen, True]


def test_two_vehicles_hide_together_what_neither_hides_alone() -> None:
    """Each cuts some of the lines; side by side they cut them all."""
    left, right = (Box(10.0, y, 0.0, 4.5, 1.8) for y in (0.9, -0.9))
    wide = Box(20.0, 0.0, math.pi / 2, 3.0, 1.0)
    assert sees(wide, left)[0]
    assert sees(wide, right)[0]
    assert not sees(wide, left._replace(y=0.89), right)[0]


def test_grazing_hides_nobody() -> None:
    """A line along the side of a box passes through no inside."""
    point = Box(20.0, 0.0, 0.0, 0.0, 0.0)
    assert sees(point, Box(10.0, 0.9, 0.0, 4.5, 1.8))[0]
    assert not sees(point, Box(10.0, 0.899, 0.0, 4.5, 1.8))[0]


def test_who_does_not_hide_others_is_seen_past() -> None:
    """And nobody hides himself; a body at the very eye is seen."""
    assert sees(PERSON, Box(10.0, 0.0, 0.0, 4.5, 1.8), hiding=False) == [True, True]
    assert in_sight(EYE, [Box(10.0, 0.0, 0.0, 4.5, 1.8)], [True]) == [True]
    assert in_sight(EYE, [Box(0.0, 0.0, 0.0, 1.0, 1.0), Box(5.0, 0, 0, 4, 2)], [False, True])[0]
    assert in_sight(EYE, [], []) == []


def reference(boxes: list[Box], hiding: list[bool]) -> list[bool | None]:
    """The same by shapely's intersections; None where a line only just touches."""
    shapes = [Polygon(corners(box)) for box in boxes]
    found: list[bool | None] = []
    for i, box in enumerate(boxes):
        cut = []
        for mark in [(box.x, box.y), *corners(box)]:
            line = LineString([EYE, mark])
            inside = [
                shape.intersection(line).length
                for j, shape in enumerate(shapes)
                if j != i and hiding[j] and not shape.contains(LineString([EYE, (0, 1e-9)]))
            ]
            cut.append(max(inside, default=0.0))
        unsure = any(0.0 < length < 1e-6 for length in cut)
        found.append(None if unsure else not all(length > 0.0 for length in cut))
    return found


def test_random_scenes_are_seen_as_shapely_sees_them() -> None:
    """Crowded and empty ones, with bodies near the eye and far from it."""
    draw, compared, hidden = random.Random(1), 0, 0
    for _ in range(80):
        size, count = draw.uniform(10.0, 60.0), draw.randrange(1, 25)
        boxes = [
            Box(*(draw.uniform(-size, size) for _ in range(2)), draw.uniform(-4, 4), *kind)
            for kind in draw.choices([(4.5, 1.8), (12.0, 2.5), (0.66, 0.88)], k=count)
        ]
        hiding = [box.length > 1.0 and draw.random() < 0.9 for box in boxes]
        for mine, other in zip(in_sight(EYE, boxes, hiding), reference(boxes, hiding), strict=True):
            if other is not None:
                compared += 1
                hidden += not other
                assert mine == other
    assert compared > 600
    assert hidden > 60
