"""Boxes against shapely and by hand; stopping zones against the reference and the exact arc."""

import json
import math

import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st
from shapely.affinity import rotate, scale, translate
from support import DATA

from cavsumo.model.geometry import (
    Box,
    corners,
    gap,
    in_frame,
    overlap,
)
from cavsumo.model.stopping_zones import (
    stopping_distances,
    zone_entered,
    zone_polygons,
)

CASES = json.loads((DATA / "assertion_vectors.json").read_text())["cases"]
ZONE_CASES = [c for c in CASES if c["metric"] == "cavgym_zones"]
VERDICTS = {
    "reaction": "interesting",
    "braking": "uninteresting_terminated",
    "body": "uninteresting_terminated",
    None: "none",
}
EGO = Box(0.0, 0.0, 0.0, 4.5, 1.75)
CAR = {"max_decel": 9.0, "reaction_time": 0.675, "wheelbase": 3.0}

places = st.floats(-8.0, 8.0)
headings = st.floats(-7.0, 7.0)
sizes = st.floats(0.01, 6.0)
boxes = st.builds(Box, places, places, headings, sizes, sizes)
egos = st.builds(
    Box, st.floats(-500, 500), st.floats(-500, 500), headings, st.floats(2, 12), st.floats(1, 3)
)
turns = st.floats(1e-4, 0.9)


def polygon(box):
    return shapely.Polygon(corners(box))


def pedestrian(x, y, heading=0.0):
    return Box(x, y, heading, 0.65625, 0.875)


# Boxes -------------------------------------------------------------------------------------------


def test_corners_by_hand():
    """A 4 m by 2 m box that faces north-east, anticlockwise from the front left."""
    r = math.sqrt(0.5)
    expected = [(r, 3 * r), (-3 * r, -r), (-r, -3 * r), (3 * r, r)]
    for point, expect in zip(corners(Box(5, 7, math.pi / 4, 4, 2)), expected, strict=True):
        assert point == pytest.approx((5 + expect[0], 7 + expect[1]))


@given(boxes)
def test_corners_enclose_the_area_anticlockwise(box):
    ring = polygon(box)
    assert ring.exterior.is_ccw
    assert ring.area == pytest.approx(box.length * box.width)


@given(boxes, boxes)
def test_overlap_and_gap_equal_shapely(a, b):
    p, q = polygon(a), polygon(b)
    distance = p.distance(q)
    depth = p.intersection(q).area
    assume(distance > 1e-9 or depth > 1e-9)
    assert overlap(a, b) is overlap(b, a) is p.intersects(q)
    assert gap(a, b) == pytest.approx(distance, abs=1e-9)
    assert gap(b, a) == pytest.approx(distance, abs=1e-9)


@pytest.mark.parametrize(
    ("a", "b", "distance"),
    [
        (Box(0, 0, 0, 4, 2), Box(4, 0, 0, 4, 2), 0.0),  # bumper to bumper
        (Box(0, 0, 0, 4, 2), Box(4, 2, 0, 4, 2), 0.0),  # corner to corner
        (Box(0, 0, 0, 4, 2), Box(7, 5, 0, 4, 2), math.hypot(3, 3)),
        (Box(0, 0, 0, 4, 2), Box(0, 3.5, 0, 1, 1), 2.0),
        (Box(0, 0, 0, 4, 2), Box(5, 0, math.pi / 4, 2, 2), 3 - math.sqrt(2)),  # corner to side
        (Box(0, 0, 0, 4, 2), Box(3, 2, math.pi / 4, 2, 2), math.sqrt(2) - 1),  # side to corner
        (Box(0, 0, 0, 9, 9), Box(1, 1, 1, 1, 1), 0.0),  # one inside the other
        (Box(0, 0, 0, 8, 1), Box(0, 0, math.pi / 2, 8, 1), 0.0),  # a cross: no corner inside
    ],
)
def test_gap_by_hand(a, b, distance):
    assert gap(a, b) == pytest.approx(distance, abs=1e-12)
    assert overlap(a, b) is (distance == 0.0)


@given(headings, st.floats(-1e4, 1e4), st.floats(-1e4, 1e4))
def test_touching_counts_in_every_direction(heading, x, y):
    c, s = math.cos(heading), math.sin(heading)
    a = Box(x, y, heading, 4.0, 2.0)
    for along, across, turn in ((3.0, 2.0, 0.0), (0.5, -1.75, math.pi / 2), (-3.0, 1.0, math.pi)):
        b = Box(x + along * c - across * s, y + along * s + across * c, heading + turn, *(1.5, 2.0))
        if along == 0.5:
            assert overlap(a, b)
            assert gap(a, b) == 0.0
        else:
            nearer = b._replace(length=2.0)
            assert overlap(a, nearer)
            assert gap(a, b) == pytest.approx(0.25, abs=1e-10)


@pytest.mark.parametrize("heading", [0.0, 0.3, math.pi / 2, 2.0])
def test_a_nanometre_apart_is_apart(heading):
    c, s = math.cos(heading), math.sin(heading)
    b = Box((3.0 + 1e-9) * c, (3.0 + 1e-9) * s, heading, 2.0, 2.0)
    assert not overlap(Box(0.0, 0.0, heading, 4.0, 2.0), b)
    assert gap(Box(0.0, 0.0, heading, 4.0, 2.0), b) == pytest.approx(1e-9, abs=1e-14)


@given(boxes, places, places, headings)
def test_frames_keep_shapes_and_distances(box, x, y, heading):
    seen = in_frame(box, x, y, heading)
    assert seen[3:] == box[3:]
    back = translate(rotate(polygon(seen), heading, origin=(0, 0), use_radians=True), x, y)
    assert shapely.hausdorff_distance(back, polygon(box)) < 1e-9


# Stopping zones ----------------------------------------------------------------------------------


def test_stopping_distances_by_hand():
    braking, reaction = stopping_distances(6.75, max_decel=9.0, reaction_time=0.675)
    assert (braking, reaction) == (2.53125, pytest.approx(4.55625))
    assert stopping_distances(0.0, max_decel=9.0, reaction_time=0.675) == (0.0, 0.0)
    assert stopping_distances(-1.0, max_decel=9.0, reaction_time=0.675) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("v", "decel", "reaction"), [(1, 0, 1), (1, -9, 1), (1, 9, -1), (math.nan, 9, 1)]
)
def test_stopping_distances_refuse_what_has_no_meaning(v, decel, reaction):
    with pytest.raises(ValueError, match="max_decel"):
        stopping_distances(v, max_decel=decel, reaction_time=reaction)


@pytest.mark.parametrize("case", ZONE_CASES, ids=[c["id"] for c in ZONE_CASES])
def test_zones_equal_the_reference(case):
    given_, expect = case["input"], case["expect"]
    how = {k: given_[k] for k in ("max_decel", "reaction_time")}
    ego = Box(0.0, 0.0, 0.0, given_["ego_length"], given_["ego_width"])
    body = Box(
        *given_["ped_centre_ego_frame"],
        given_["ped_heading_ego_frame"],
        given_["ped_length"],
        given_["ped_width"],
    )
    entered = zone_entered(
        body, ego, given_["ego_speed"], steering=given_["steering"], wheelbase=3.0, **how
    )
    assert VERDICTS[entered] == expect["verdict"]
    distances = stopping_distances(given_["ego_speed"], **how)
    assert distances == pytest.approx((float(expect["braking_m"]), float(expect["reaction_m"])))


@pytest.mark.parametrize(
    ("body", "v", "entered"),
    [
        (pedestrian(2.0, 0.0), 6.75, "body"),
        (pedestrian(2.0, 0.0), 0.0, "body"),
        (pedestrian(2.25 + 0.328125, 0.0), 0.0, "body"),  # touches the bumper
        (pedestrian(2.6, 0.0), 0.0, None),
        (pedestrian(2.6, 0.0), 6.75, "braking"),
        (pedestrian(4.78125 + 0.328125, 0.0), 6.75, "braking"),  # touches the end of it
        (pedestrian(5.2, 0.0), 6.75, "reaction"),
        (pedestrian(9.3375 + 0.328125, 0.0), 6.75, "reaction"),
        (pedestrian(9.3375 + 0.329, 0.0), 6.75, None),
        (pedestrian(7.0, -1.3125), 6.75, "reaction"),
        (pedestrian(7.0, -1.3126), 6.75, None),
        (pedestrian(7.0, 0.875 + 0.328125, math.pi / 2), 6.75, "reaction"),  # walks across
        (pedestrian(7.0, 0.875 + 0.329, math.pi / 2), 6.75, None),
        (pedestrian(-3.0, 0.0), 6.75, None),  # behind
        (pedestrian(0.0, 3.0), 6.75, None),  # beside
        (pedestrian(60.0, 0.0), 6.75, None),  # far
    ],
)
@pytest.mark.parametrize("pose", [(0.0, 0.0, 0.0), (12.0, -30.0, 0.7), (-1e3, 2e3, -3.0)])
def test_straight_zones_by_hand(body, v, entered, pose):
    """The same answers wherever the ego stands and whatever its heading."""
    x, y, heading = pose
    c, s = math.cos(heading), math.sin(heading)
    moved = Box(
        x + body.x * c - body.y * s, y + body.x * s + body.y * c, body.heading + heading, *body[3:]
    )
    assert zone_entered(moved, Box(x, y, heading, 4.5, 1.75), v, **CAR) == entered


@given(egos, st.floats(0.5, 30.0))
def test_straight_zones_have_the_stopping_distances_as_lengths(ego, v):
    zones = zone_polygons(ego, v, **CAR)
    for points, length in zip(
        zones, stopping_distances(v, max_decel=9.0, reaction_time=0.675), strict=True
    ):
        assert shapely.Polygon(points).area == pytest.approx(length * ego.width)
        assert math.dist(points[0], points[1]) == pytest.approx(length)
    for point, corner in ((zones.braking[1], 0), (zones.braking[2], 3)):
        assert point == pytest.approx(corners(ego)[corner])


def test_an_ego_at_rest_has_no_zones():
    assert zone_polygons(EGO, 0.0, steering=0.3, **CAR) == ([], [])
    no_reaction = zone_polygons(EGO, 5.0, max_decel=9.0, reaction_time=0.0, wheelbase=3.0)
    assert no_reaction.reaction == []


@pytest.mark.parametrize("bad", [{"steering": math.pi / 2}, {"steering": math.nan}, {"b": 0.0}])
def test_bad_arguments_of_an_arc_are_named(bad):
    how = CAR | ({"wheelbase": 0.0} if "b" in bad else bad)
    with pytest.raises(ValueError, match="steering"):
        zone_entered(pedestrian(5, 0), EGO, 6.75, **how)


# Zones along an arc ------------------------------------------------------------------------------


def exact_zones(ego, v, steering, wheelbase, chords=400):
    """Both zones in the frame of the ego, from the definition, as fine shapely polygons.

    The strip is the ring of the ego's width about the circle of the bumper's centre; the triangle
    between the bumper and the start of the ring belongs to the braking zone.
    """
    cx, cy = -wheelbase / 2, wheelbase / math.tan(abs(steering))
    front = ego.length / 2
    radius, start = math.hypot(front - cx, cy), math.atan2(-cy, front - cx)
    inner, outer = radius - ego.width / 2, radius + ego.width / 2

    def edge(r, begin, length):
        angles = [start + (begin + length * i / chords) / radius for i in range(chords + 1)]
        return [(cx + r * math.cos(a), cy + r * math.sin(a)) for a in angles]

    zones, begin = [], 0.0
    for length in stopping_distances(v, max_decel=9.0, reaction_time=0.675):
        far = edge(outer, begin, length)
        zones.append(shapely.Polygon([*far, *reversed(edge(inner, begin, length))]))
        begin += length
    triangle = [(front, 0.0), (front, -ego.width / 2), edge(outer, 0.0, 0.0)[0]]
    # A nanometre wider, or rounding may leave a slit between the two.
    zones[0] = zones[0].union(shapely.Polygon(triangle).buffer(1e-9, join_style="mitre"))
    if steering < 0:
        zones = [scale(z, 1, -1, origin=(0, 0)) for z in zones]
    return zones


ARCS = [
    (6.75, 0.2 * math.pi),
    (6.75, 0.05),
    (6.75, -0.3),
    (9.0, -0.2 * math.pi),
    (20.0, 0.01),
    (2.0, 0.6),
    (0.5, -0.6),
]


@pytest.mark.parametrize(("v", "steering"), ARCS)
def test_drawn_arcs_lie_within_a_centimetre_of_the_exact_ones(v, steering):
    drawn = zone_polygons(EGO, v, steering=steering, **CAR)
    for points, exact in zip(drawn, exact_zones(EGO, v, steering, 3.0), strict=True):
        ring = shapely.Polygon(points)
        assert ring.is_valid
        assert ring.exterior.is_ccw
        assert shapely.hausdorff_distance(ring.exterior, exact.exterior, densify=0.01) < 0.01
        assert len(points) < 60


@pytest.mark.parametrize(("v", "steering"), ARCS)
def test_arc_zones_have_the_stopping_distances_as_lengths(v, steering):
    """Width times arc length is the area of a bent strip; the braking zone has the triangle too."""
    braking, reaction = exact_zones(EGO, v, steering, 3.0)
    d_b, d_r = stopping_distances(v, max_decel=9.0, reaction_time=0.675)
    tilt = math.atan2(3.75, 3.0 / math.tan(abs(steering)))
    triangle = 0.5 * 0.875**2 * math.sin(tilt)
    assert reaction.area == pytest.approx(1.75 * d_r, rel=1e-5)
    assert braking.area == pytest.approx(1.75 * d_b + triangle, rel=1e-5)
    drawn = zone_polygons(EGO, v, steering=steering, **CAR)
    assert shapely.Polygon(drawn.reaction).area == pytest.approx(reaction.area, rel=0.01)
    assert shapely.Polygon(drawn.braking).area == pytest.approx(braking.area, rel=0.01)


@pytest.fixture(scope="module")
def exact_arcs():
    return [(v, e, exact_zones(EGO, v, e, 3.0)) for v, e in ARCS]


@given(
    st.integers(0, len(ARCS) - 1),
    st.floats(-1, 12),
    st.floats(-9, 9),
    headings,
    st.floats(0.01, 3),
    st.floats(0.01, 3),
    st.tuples(st.floats(-300, 300), st.floats(-300, 300), headings),
)
def test_arc_zones_equal_the_exact_ones(exact_arcs, case, x, y, heading, length, width, pose):
    """Decided as shapely decides on the exact region, except within 0.1 mm of its boundary."""
    v, steering, (braking, reaction) = exact_arcs[case]
    box = Box(x, y, heading, length, width)
    shape = polygon(box)
    expected, clear = None, True
    for name, zone in (("reaction", reaction), ("braking", braking), ("body", polygon(EGO))):
        if shape.intersects(zone):
            expected = name
        clear &= shape.buffer(1e-4).intersects(zone) == shape.intersects(zone.buffer(-1e-4))
    assume(clear)
    px, py, po = pose
    c, s = math.cos(po), math.sin(po)
    moved = Box(px + x * c - y * s, py + x * s + y * c, heading + po, length, width)
    ego = Box(px, py, po, EGO.length, EGO.width)
    assert zone_entered(moved, ego, v, steering=steering, **CAR) == expected


@pytest.mark.parametrize("steering", [0.2 * math.pi, 0.05, 3e-4, -3e-4, -0.3])
def test_the_edges_of_an_arc_are_sharp(steering):
    """A point 1 mm inside an edge of the reaction zone is in it, one 1 mm outside is not."""
    cx, cy, side = -1.5, 3.0 / math.tan(abs(steering)), math.copysign(1.0, steering)
    radius, start = math.hypot(2.25 - cx, cy), math.atan2(-cy, 2.25 - cx)
    d_b, d_r = stopping_distances(6.75, max_decel=9.0, reaction_time=0.675)
    inside = [(0.5, 0.874), (0.5, -0.874), (0.999, 0.8), (0.999, -0.8)]
    outside = [(0.9, 0.876), (0.9, -0.876), (1.001, 0.8), (1.001, -0.8)]
    for (along, offset), expected in zip(
        inside + outside, ["reaction"] * 4 + [None] * 4, strict=True
    ):
        angle = start + (d_b + along * d_r) / radius
        x = cx + (radius + offset) * math.cos(angle)
        y = side * (cy + (radius + offset) * math.sin(angle))
        body = Box(x, y, 0.4, 1e-6, 1e-6)
        assert zone_entered(body, EGO, 6.75, steering=steering, **CAR) == expected


@given(st.floats(-1, 12), st.floats(-9, 9), headings, turns, st.floats(0.1, 12.0))
def test_left_and_right_are_mirror_images(x, y, heading, steering, v):
    left = zone_entered(Box(x, y, heading, 0.7, 0.9), EGO, v, steering=steering, **CAR)
    right = zone_entered(Box(x, -y, -heading, 0.7, 0.9), EGO, v, steering=-steering, **CAR)
    assert left == right
    one, other = (zone_polygons(EGO, v, steering=e, **CAR) for e in (steering, -steering))
    for points, mirrored in zip(one, other, strict=True):
        assert sorted(points) == sorted((x, -y) for x, y in mirrored)


@given(st.floats(1e-12, 1e-3), st.floats(-1, 12), st.floats(-2, 2), headings, st.floats(0.5, 12.0))
def test_the_arc_tends_to_the_straight_strip(steering, x, y, heading, v):
    """A strip departs from the straight one by about d (ahead + d / 2) tan(e) / b."""
    d = sum(stopping_distances(v, max_decel=9.0, reaction_time=0.675))
    bound = 1.01 * (d * (3.75 + d / 2) + 0.875 * 3.75) * math.tan(steering) / 3.0 + 1e-6
    straight = zone_polygons(EGO, v, **CAR)
    bent = zone_polygons(EGO, v, steering=steering, **CAR)
    for one, other in zip(straight, bent, strict=True):
        one, other = shapely.Polygon(one), shapely.Polygon(other)
        assert shapely.hausdorff_distance(one, other) <= bound
    body = Box(x, y, heading, 0.7, 0.9)
    inner, outer = (
        zone_entered(body._replace(length=0.7 + d, width=0.9 + d), EGO, v, **CAR)
        for d in (-2 * bound, 2 * bound)
    )
    if inner == outer:
        assert zone_entered(body, EGO, v, steering=steering, **CAR) == inner


@pytest.mark.parametrize("steering", [0.2, -0.2, 0.6, -0.6])
def test_nothing_stands_unseen_right_ahead_of_the_bumper(steering):
    """Whatever stands 1 cm ahead of the bumper is in the braking zone while the ego steers."""
    for i in range(-8, 9):
        body = Box(2.26, 0.1 * i, 0.3, 1e-3, 1e-3)
        assert zone_entered(body, EGO, 9.0, steering=steering, **CAR) == "braking"


def test_a_strip_of_many_turns_is_one_ring():
    """A tight turn at speed: the strip closes on itself, and the braking zone is all of it."""
    ego = Box(0, 0, 0, 1.0, 0.5)
    how = {"max_decel": 1.0, "reaction_time": 1.0, "wheelbase": 0.6, "steering": 1.2}
    rear = 0.6 / math.tan(1.2)
    radius = math.hypot(rear, 0.8)
    for i in range(12):
        x = -0.3 + radius * math.cos(i)
        y = rear + radius * math.sin(i)
        assert zone_entered(Box(x, y, 0, 0.01, 0.01), ego, 10.0, **how) in ("braking", "body")
    assert zone_entered(Box(-0.3, rear, 0, 0.01, 0.01), ego, 10.0, **how) in (None, "body")
    assert zone_entered(Box(-0.3, rear + radius + 0.3, 0, 0.01, 0.01), ego, 10.0, **how) is None
    assert zone_entered(Box(-0.3, rear, 0, 50.0, 50.0), ego, 10.0, **how) == "body"
