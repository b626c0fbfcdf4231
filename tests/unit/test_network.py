"""What is read from a network: what is refused and why, and the ego's route through it."""

from __future__ import annotations

import gzip
import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import libsumo
import pytest
from shapely.geometry import LineString, Point

from cavsumo.errors import InputError, NetworkError, UnknownName
from cavsumo.model.snapshot import Snapshot
from cavsumo.network.movements import APPROACH_M
from cavsumo.network.reader import Network, driving_lanes, lane_shape, read_network
from cavsumo.sumo.world import World

Staged = Callable[..., Any]
ALL = pytest.mark.parametrize("name", ["pedestrians", "crossing", "junction"])
Edit = Callable[[ElementTree.Element], None]


@pytest.fixture(scope="module")
def read(networks: dict[str, Path]) -> dict[str, Network]:
    """The three networks, read once."""
    return {name: read_network(file) for name, file in networks.items()}


@pytest.fixture
def edited(networks: dict[str, Path], tmp_path: Path) -> Callable[[Edit], Path]:
    """Call with a function that changes the straight road's XML: the changed network's file."""

    def edit(change: Edit) -> Path:
        tree = ElementTree.parse(networks["pedestrians"])
        change(tree.getroot())
        file = tmp_path / "edited.net.xml"
        tree.write(file, encoding="utf-8")
        return file

    return edit


# Reading


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("hello", "not well-formed XML"),
        ("", "not well-formed XML"),
        ('<net version="1.20"><edge id="a">', "not well-formed XML"),
        ("<routes/>", "begins with <net>, this file with <routes>"),
        ('<net version="1.20"/>', "no lane on which a car may drive"),
        ("<net/>", "cannot be read"),
    ],
)
def test_what_is_no_network_is_refused(tmp_path: Path, content: str, words: str) -> None:
    """Text, nothing, half a network, another sort of file, an empty network: one line says why."""
    file = tmp_path / "bad.net.xml"
    file.write_text(content, encoding="utf-8")
    with pytest.raises(NetworkError) as refused:
        read_network(file)
    assert words in str(refused.value)
    assert "bad.net.xml" in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_missing_network_names_its_neighbours(networks: dict[str, Path]) -> None:
    """A misspelt file name: the networks that do lie there are listed."""
    with pytest.raises(NetworkError, match=r"no such file; .*crossing\.net\.xml, junction"):
        read_network(networks["crossing"].with_name("crosing.net.xml"))


def test_a_compressed_network_is_the_same_network(
    networks: dict[str, Path], tmp_path: Path
) -> None:
    """A network in gzip is read like the plain one; half of such a file is refused."""
    packed = gzip.compress(networks["pedestrians"].read_bytes())
    whole, half = tmp_path / "whole.net.xml.gz", tmp_path / "half.net.xml.gz"
    whole.write_bytes(packed)
    half.write_bytes(packed[: len(packed) // 2])
    assert [e.getID() for e in read_network(whole).edges] == ["eastbound", "westbound"]
    with pytest.raises(NetworkError, match="not well-formed"):
        read_network(half)


def _without_pavements(net: ElementTree.Element) -> None:
    for edge in net.iter("edge"):
        for lane in edge.findall("lane"):
            if lane.get("allow") == "pedestrian":
                edge.remove(lane)
    for junction in net.iter("junction"):
        junction.set("incLanes", (junction.get("incLanes") or "").split()[-1])


def _without_cars(net: ElementTree.Element) -> None:
    for lane in net.iter("lane"):
        lane.attrib.pop("disallow", None)
        lane.set("allow", "pedestrian")


def _with_far_pavements(net: ElementTree.Element) -> None:
    for lane in net.iter("lane"):
        if lane.get("allow"):
            lane.set("shape", "0,500 99,500")


def _three_metres_long(net: ElementTree.Element) -> None:
    for lane in net.iter("lane"):
        lane.set("length", "3.0")
        lane.set("shape", (lane.get("shape") or "").replace("99.000", "3.000"))


def _with_a_point_for_a_lane(net: ElementTree.Element) -> None:
    for lane in net.iter("lane"):
        lane.set("shape", "0.000,-1.825")


def _with_no_width(net: ElementTree.Element) -> None:
    for lane in net.iter("lane"):
        lane.set("width", "nan")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_without_pavements, "no pavements for pedestrians"),
        (_without_cars, "no lane on which a car may drive"),
        (_with_far_pavements, "no pavement lies beside the ego's route"),
        (_three_metres_long, "shorter than the ego"),
        pytest.param(_with_a_point_for_a_lane, "edited"),
        pytest.param(_with_no_width, "edited"),
    ],
)
def test_a_network_that_cannot_serve_is_refused(
    staged: Staged, edited: Callable[[Edit], Path], change: Edit, words: str
) -> None:
    """Nowhere to walk, to drive or to cross, lanes without shape: one line that names the file."""
    with pytest.raises(NetworkError, match=words) as refused:
        staged(net=edited(change))
    assert "edited.net.xml" in str(refused.value)
    assert "\n" not in str(refused.value)


# The ego's route


def test_a_misspelt_edge_or_junction_suggests_the_nearest(staged: Staged) -> None:
    """The name that was probably meant is in the message."""
    with pytest.raises(UnknownName, match="'eastbund'; did you mean 'eastbound'"):
        staged(ego_route=["eastbund"])
    with pytest.raises(UnknownName, match="'2529156'; did you mean '25291565'"):
        staged("junction", junction="2529156")


def test_routes_that_no_car_can_drive_are_refused(staged: Staged) -> None:
    """Edges that do not connect, and a junction that only ends roads."""
    with pytest.raises(NetworkError, match="no car can follow the route eastbound westbound"):
        staged(ego_route=["eastbound", "westbound"])
    with pytest.raises(InputError, match="no car can drive through junction 'east'"):
        staged(junction="east")


def test_a_given_route_is_driven_from_end_to_end(staged: Staged) -> None:
    """The ego's centre starts at the beginning of the first edge; its front arrives at the end."""
    route = staged(ego_route=["westbound"])[1].route
    assert (route.edges, route.lane, route.junction) == (("westbound",), 1, None)
    assert route.path.points == ((99.0, 1.825), (0.0, 1.825))
    assert (route.depart_m, route.arrive_m) == (2.25, 99.0)


@ALL
def test_the_derived_route_is_one_a_car_can_drive(
    staged: Staged, read: dict[str, Network], name: str
) -> None:
    """Its lanes are for cars, its path has no gap or jump, and it leads through the junction."""
    network, route = read[name], staged(name)[1].route
    edges = [network.edge(edge) for edge in route.edges]
    assert all(driving_lanes(edge) for edge in edges)
    assert driving_lanes(edges[0])[0].getIndex() <= route.lane
    shapes = [lane_shape(lane) for edge in edges for lane in driving_lanes(edge)]
    surface = read[name].roads().carriageway.buffer(0.01)
    assert LineString(route.path.points).within(surface)
    assert any(Point(route.path.points[-1]).distance(LineString(s)) < 0.01 for s in shapes)
    if name != "pedestrians":
        node = network.junction(route.junction or "")
        assert any(a.getToNode() is node is b.getFromNode() for a, b in pairwise(edges))


@pytest.mark.parametrize(
    ("name", "ego_route"),
    [
        ("pedestrians", []),
        ("crossing", []),
        ("crossing", ["-232008578", "36730335#1"]),  # a right turn
        ("junction", []),
        ("junction", ["-76334538", "-21081120#0"]),  # a left turn
    ],
)
def test_sumo_drives_the_ego_along_its_path(
    open_world: Callable[..., World], name: str, ego_route: list[str]
) -> None:
    """The front bumper of the ego that SUMO drives never leaves the path, from start to end."""
    with open_world(name, ego_route=ego_route) as world:
        path = world.site.route.path
        snapshot: Snapshot | None = world.reset(1, (), ())
        assert snapshot is not None
        assert math.dist((snapshot.ego.x, snapshot.ego.y), path.points[0]) < 0.1
        alongs = []
        while snapshot is not None:
            front = path.project(*libsumo.vehicle.getPosition("ego"))
            alongs.append(front.along)
            assert abs(front.lateral) < 1e-3
            snapshot = world.step((), None)
        assert alongs == sorted(alongs)
        assert path.length - alongs[-1] < 2.0


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(
            "crossing",
        ),
        "junction",
    ],
)
def test_the_ego_starts_within_the_approach(
    staged: Staged, read: dict[str, Network], name: str
) -> None:
    """From the ego's front at the start to the junction under test it is at most 80 m."""
    route = staged(name)[1].route
    node = read[name].junction(route.junction or "")
    before = next(e for e in map(read[name].edge, route.edges) if e.getToNode() is node)
    stops = [route.path.project(*lane_shape(lane)[-1]) for lane in driving_lanes(before)]
    stop = min(stops, key=lambda p: abs(p.lateral))
    assert 20.0 < stop.along - 2.25 <= APPROACH_M + 0.1
