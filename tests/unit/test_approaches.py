"""On which ways vehicles meet the ego: where, of what type, who gives way, where they start."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from cavsumo.egos.base import EGO_KIND
from cavsumo.errors import NetworkError
from cavsumo.model.bodies import BICYCLE, BUS, CAR, KINDS, Kind
from cavsumo.model.carriageway import Approach
from cavsumo.model.geometry import Box, gap
from cavsumo.network.approaches import approaches
from cavsumo.network.ego_routes import derived_routes, given_route
from cavsumo.network.lane_chains import without_corners
from cavsumo.network.reader import read_network
from cavsumo.network.vehicle_starts import APART_M, draw_vehicles

QUARTER = " ".join(
    f"{12 - 12 * math.cos(a):.3f},{-12 + 12 * math.sin(a):.3f}"
    for a in (math.pi / 2 * i / 8 for i in range(9))
)


def lane(name: str, shape: str, index: int = 0) -> str:
    """A lane of 10 m/s that nobody walks on."""
    points = [tuple(map(float, p.split(","))) for p in shape.split()]
    length = sum(math.dist(a, b) for a, b in pairwise(points))
    return (
        f'<lane id="{name}_{index}" index="{index}" speed="10" length="{length:.3f}" '
        f'disallow="pedestrian" shape="{shape}"/>'
    )


# Two one-way roads that cross: from the west to the east with priority, from the south to the
# north, and from the south to the east round a bend of 12 m.
CROSSROADS = f"""<net version="1.20">
<location netOffset="0,0" convBoundary="0,0,1,1" origBoundary="0,0,1,1" projParameter="!"/>
<edge id=":j_0" function="internal">{lane(":j_0", "0,-12 0,12")}</edge>
<edge id=":j_1" function="internal">{lane(":j_1", QUARTER)}</edge>
<edge id=":j_2" function="internal">{lane(":j_2", "-12,0 12,0")}</edge>
<edge id="from_s" from="s" to="j" priority="1">{lane("from_s", "0,-100 0,-12")}</edge>
<edge id="from_w" from="w" to="j" priority="2">{lane("from_w", "-100,0 -12,0")}</edge>
<edge id="to_e" from="j" to="e" priority="2">{lane("to_e", "12,0 100,0")}</edge>
<edge id="to_n" from="j" to="n" priority="1">{lane("to_n", "0,12 0,100")}</edge>
<junction id="j" type="priority" x="0" y="0" incLanes="from_s_0 from_w_0"
    intLanes=":j_0_0 :j_1_0 :j_2_0" shape="-12,-2 12,-2 12,2 -12,2">
  <request index="0" response="100" foes="100" cont="0"/>
  <request index="1" response="100" foes="100" cont="0"/>
  <request index="2" response="000" foes="011" cont="0"/>
</junction>
<junction id="s" type="dead_end" x="0" y="-100" incLanes="" intLanes="" shape="0,-100 1,-100"/>
<junction id="w" type="dead_end" x="-100" y="0" incLanes="" intLanes="" shape="-100,0 -100,1"/>
<junction id="e" type="dead_end" x="100" y="0" incLanes="to_e_0" intLanes="" shape="100,0 100,1"/>
<junction id="n" type="dead_end" x="0" y="100" incLanes="to_n_0" intLanes="" shape="0,100 1,100"/>
<connection from="from_s" to="to_n" fromLane="0" toLane="0" via=":j_0_0" dir="s" state="m"/>
<connection from="from_s" to="to_e" fromLane="0" toLane="0" via=":j_1_0" dir="r" state="m"/>
<connection from="from_w" to="to_e" fromLane="0" toLane="0" via=":j_2_0" dir="s" state="M"/>
<connection from=":j_0" to="to_n" fromLane="0" toLane="0" dir="s" state="M"/>
<connection from=":j_1" to="to_e" fromLane="0" toLane="0" dir="r" state="M"/>
<connection from=":j_2" to="to_e" fromLane="0" toLane="0" dir="s" state="M"/>
</net>"""

# One road with two lanes to the east.
TWO_LANES = f"""<net version="1.20">
<location netOffset="0,0" convBoundary="0,0,100,10" origBoundary="0,0,1,1" projParameter="!"/>
<edge id="road" from="w" to="e" priority="1">
{lane("road", "0,0 150,0")}{lane("road", "0,3.2 150,3.2", 1)}</edge>
<junction id="w" type="dead_end" x="0" y="0" incLanes="" intLanes="" shape="0,0 0,3"/>
<junction id="e" type="dead_end" x="150" y="0" incLanes="road_0 road_1" intLanes=""
    shape="150,0 150,3"/>
</net>"""


def found_in(
    file: Path, edges: Sequence[str] = (), kind: Kind = CAR, wanted: Sequence[str] = ()
) -> tuple[Approach, ...]:
    """The approaches in a network file, to the route given or derived."""
    network, half = read_network(file, foes=True), EGO_KIND.length / 2
    route = (
        given_route(network, edges, half) if edges else next(derived_routes(network, None, half))
    )
    return approaches(network, route, EGO_KIND, kind, wanted)


@pytest.fixture
def crossroads(tmp_path: Path) -> Path:
    """The two one-way roads as a file."""
    file = tmp_path / "crossroads.net.xml"
    file.write_text(CROSSROADS, encoding="utf-8")
    return file


@pytest.fixture
def two_lanes(tmp_path: Path) -> Path:
    """The road with two lanes as a file."""
    file = tmp_path / "two_lanes.net.xml"
    file.write_text(TWO_LANES, encoding="utf-8")
    return file


def mirrored(file: Path, to: Path) -> Path:
    """The network in a looking glass: right-hand traffic becomes left-hand traffic."""
    tree = ElementTree.parse(file)
    tree.getroot().set("lefthand", "true")
    for element in tree.iter():
        if "shape" in element.attrib:
            points = (point.split(",") for point in element.attrib["shape"].split())
            element.set("shape", " ".join(f"{-float(x)},{y}" for x, y, *_ in points))
        if element.tag == "junction":
            element.set("x", f"{-float(element.attrib['x'])}")
        if element.tag == "connection" and element.get("dir") in ("l", "r", "L", "R"):
            element.set("dir", element.attrib["dir"].translate(str.maketrans("lrLR", "rlRL")))
    tree.write(to)
    return to


def test_a_crossing_way_is_measured_by_the_boxes(crossroads: Path) -> None:
    """Hand-computed: the box from the south touches the ego's strip 0.875 m off its axis."""
    way = next(a for a in found_in(crossroads, ["from_w", "to_e"]) if a.type == "crossing")
    assert way.enter == pytest.approx(100.0 - 0.875 - 2.25, abs=0.5)
    assert way.leave == pytest.approx(100.0 + 0.875 + 2.25, abs=0.5)
    assert way.ego_enter == pytest.approx(100.0 - 0.875, abs=0.01)
    assert way.wait == pytest.approx(88.0 - 2.25 - 0.5)
    assert way.edges == ("from_s", "to_n")
    assert (way.speed, way.ego_speed) == (10.0, 10.0)


def test_types_and_who_gives_way(crossroads: Path) -> None:
    """The way with priority makes the others give way, and is given way to."""
    to_east = found_in(crossroads, ["from_w", "to_e"])
    assert [(a.type, a.yields) for a in to_east] == [
        ("crossing", True),
        ("merging", True),
        ("following", False),
    ]
    assert math.isinf(to_east[1].leave)
    to_north = found_in(crossroads, ["from_s", "to_n"])
    assert [(a.type, a.yields) for a in to_north] == [("crossing", False), ("following", False)]


def test_a_lane_beside_the_egos(two_lanes: Path) -> None:
    """Both lanes have the other one beside them, side by side all along."""
    following, beside = found_in(two_lanes, ["road"])
    assert (following.type, beside.type) == ("following", "adjacent")
    assert beside.path.points[0][1] == 3.2
    assert beside.leave - beside.enter > 140.0
    assert beside.into is not None
    assert beside.into.points[0][1] == 0.0


@pytest.mark.parametrize(
    ("name", "types"),
    [
        ("pedestrians", {"following"}),
        ("crossing", {"crossing", "merging", "following"}),
        ("junction", {"crossing", "merging", "following"}),
    ],
)
def test_what_the_networks_offer(networks: Mapping[str, Path], name: str, types: set[str]) -> None:
    """Oncoming vehicles that turn across among them; at the signals everybody else has red."""
    found = found_in(networks[name])
    assert {a.type for a in found} == types
    for approach in found:
        length = approach.path.length
        assert 0.0 <= approach.enter < min(approach.leave, length)
        assert approach.yields == (approach.type in ("crossing", "merging"))
        if approach.yields:
            assert CAR.length / 2 <= approach.wait < approach.enter


@pytest.mark.parametrize("name", ["crossing", "junction"])
def test_the_side_of_the_road_does_not_matter(
    networks: Mapping[str, Path], tmp_path: Path, name: str
) -> None:
    """In the looking glass the same ways meet at the same places."""
    file = mirrored(networks[name], tmp_path / "mirror.net.xml")
    for here, there in zip(found_in(networks[name]), found_in(file), strict=True):
        assert (here.type, here.edges, here.yields) == (there.type, there.edges, there.yields)
        for part in ("wait", "enter", "leave", "ego_enter"):
            assert getattr(there, part) == pytest.approx(getattr(here, part), abs=0.51)


def test_a_bus_is_given_no_way_that_it_cannot_turn(networks: Mapping[str, Path]) -> None:
    """CAV-Gym's bus turns on 32 m only, a bicycle everywhere."""
    bus, bicycle = (found_in(networks["crossing"], kind=k) for k in (BUS, BICYCLE))
    assert bus
    assert len(bus) < len(bicycle)


def test_wanted_types_only_and_none_is_one_sentence(networks: Mapping[str, Path]) -> None:
    """What is asked for and is not there is named, with what there is."""
    assert {a.type for a in found_in(networks["crossing"], wanted=["merging"])} == {"merging"}
    with pytest.raises(NetworkError, match=r"no crossing way for a car.*there are: following"):
        found_in(networks["pedestrians"], wanted=["crossing"])


def test_corners_that_nobody_can_drive_are_cut() -> None:
    """Where a lane begins before the end of the one before, the way does not lead back."""
    path = without_corners([(0, 0), (20, 0), (16, 0.5), (40, 0.5)])
    assert path.points == ((0, 0), (16, 0.5), (40, 0.5))


@pytest.mark.parametrize("kind", ["car", "bicycle"])
@pytest.mark.parametrize("name", ["pedestrians", "crossing", "junction"])
def test_vehicles_start_apart_and_in_time(staged: Callable[..., Any], name: str, kind: str) -> None:
    """Boxes apart from each other and the ego; who crosses can still wait for the ego."""
    site, k = staged(name, kind=kind)[1], KINDS[kind]
    ego = Box(*site.route.path.at(0.0), EGO_KIND.length, EGO_KIND.width)
    for seed in range(40):
        rng = np.random.default_rng(seed)
        starts = draw_vehicles(site.approaches, [k] * 3, ego, None, rng)
        boxes = [ego, *(Box(s.x, s.y, s.o, k.length, k.width) for s in starts)]
        assert all(gap(a, b) > APART_M for i, a in enumerate(boxes) for b in boxes[:i])
        for start in starts:
            assert start.approach is not None
            assert start.v is not None
            assert 0.0 <= start.v <= k.v_max
            along = start.approach.path.project(start.x, start.y).along
            room = start.approach.wait - along
            assert start.v**2 / 6.0 <= room + 1e-6


def test_the_start_speed_can_be_given(staged: Callable[..., Any]) -> None:
    """Then it is everybody's, within what the kind can."""
    site = staged("crossing", kind="car")[1]
    ego = Box(*site.route.path.at(0.0), EGO_KIND.length, EGO_KIND.width)
    rng = np.random.default_rng(1)
    assert {s.v for s in draw_vehicles(site.approaches, [CAR] * 3, ego, 4.0, rng)} == {4.0}
    assert {s.v for s in draw_vehicles(site.approaches, [CAR] * 3, ego, 40.0, rng)} == {9.0}


def test_too_many_vehicles_are_refused(two_lanes: Path) -> None:
    """One sentence, before anything is played."""
    found, ego = found_in(two_lanes, ["road"]), Box(2.25, 0.0, 0.0, 4.5, 1.75)
    with pytest.raises(NetworkError, match="no room for 90 vehicles"):
        draw_vehicles(found, [CAR] * 90, ego, None, np.random.default_rng(1))
