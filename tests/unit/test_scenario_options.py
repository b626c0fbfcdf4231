"""Options of a scenario: the ego's route by a turn, testers that jaywalk."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from shapely.geometry import LineString, Point

from cavsumo.errors import InputError, NetworkError, UnknownName
from cavsumo.model.bodies import BICYCLE, PEDESTRIAN, Kind
from cavsumo.model.scenario import BatchPlan
from cavsumo.network.jaywalk_starts import STRIP_M
from cavsumo.network.movements import TURNS
from cavsumo.network.pedestrian_starts import draw_starts
from cavsumo.network.site import Site

Staged = Callable[..., tuple[BatchPlan, Site]]
# Which way a path turns between its ends [degrees].
TURNING = {"straight": (-45.0, 45.0), "left": (45.0, 150.0), "right": (-150.0, -45.0)}


def turned(site: Site) -> float:
    """The angle between the directions in which the ego's path ends and begins [degrees]."""
    path = site.route.path
    return math.degrees(math.remainder(path.at(path.length)[2] - path.at(0.0)[2], 2 * math.pi))


# Turns


@pytest.mark.parametrize("name", ["crossing", "junction"])
@pytest.mark.parametrize("turn", ["straight", "left", "right"])
def test_a_turn_is_a_way_through_the_junction_under_test(
    staged: Staged, name: str, turn: str
) -> None:
    """It leads through the same junction as without a turn, and turns by its geometry."""
    junction = staged(name)[1].route.junction
    site = staged(name, ego_route=[turn])[1]
    assert site.route.junction == junction
    low, high = TURNING[turn]
    assert low < turned(site) < high
    assert site.areas


def test_the_best_straight_way_is_the_default_one(staged: Staged) -> None:
    """Asking for what is chosen anyway changes nothing; in a scenario file it is a word."""
    default = staged("junction")[1].route
    for route in (["straight"], "straight"):
        chosen = staged("junction", ego_route=route)[1].route
        assert chosen.path.points == default.path.points
        assert dataclasses.replace(chosen, path=default.path) == default


def test_a_turn_at_another_junction(staged: Staged) -> None:
    """--junction says where."""
    site = staged("junction", junction="1377211666", ego_route="left")[1]
    assert site.route.junction == "1377211666"
    assert 45.0 < turned(site) < 150.0


def test_ways_that_are_not_there_are_named(staged: Staged) -> None:
    """The turns that a junction does have; a network without junctions; a word that is no turn."""
    with pytest.raises(NetworkError, match=r"no way 'u-turn'.*the ways there: straight, left, ri"):
        staged("junction", ego_route="u-turn")
    with pytest.raises(NetworkError, match="has no junction with a way 'left'"):
        staged("pedestrians", ego_route="left")
    with pytest.raises(UnknownName, match="unknown edge or turn 'lfet'; did you mean 'left'"):
        staged("junction", ego_route="lfet")
    with pytest.raises(UnknownName, match="unknown edge 'left'"):
        staged("junction", ego_route="left right")


def test_an_edge_named_like_a_turn_is_an_edge(
    staged: Staged, networks: dict[str, Path], tmp_path: Path
) -> None:
    """Ids are opaque; whoever has an edge called left can still name it."""
    file = tmp_path / "named.net.xml"
    text = networks["pedestrians"].read_text(encoding="utf-8")
    file.write_text(text.replace("westbound", "left"), encoding="utf-8")
    assert staged(net=file, ego_route="left")[1].route.edges == ("left",)
    assert "left" in TURNS


# Jaywalkers


@pytest.mark.parametrize("name", ["pedestrians", "crossing", "junction"])
@pytest.mark.parametrize("kind", [PEDESTRIAN, BICYCLE])
def test_jaywalkers_start_beside_the_road(staged: Staged, name: str, kind: Kind) -> None:
    """Off the carriageway, within a strip along it, and their way across meets the ego's."""
    site = staged(name, jaywalk=True)[1]
    path = LineString(site.route.path.points)
    rng = np.random.default_rng(1)
    sides = set()
    for _ in range(60):
        for start in draw_starts(site.areas, [kind] * 3, rng):
            assert not site.roads.contains(start.x, start.y)
            assert site.roads.edge_distance(start.x, start.y) <= STRIP_M + 0.2
            sides.add(site.route.path.project(start.x, start.y).lateral > 0)
    assert sides == {True, False}
    for area in site.areas:
        x, y, _ = area.pavement.at((area.begin + area.end) / 2)
        way = site.roads.crossing(x, y)
        assert way is not None
        end = (x + way.leave * math.cos(way.heading), y + way.leave * math.sin(way.heading))
        if area.end - area.begin <= 1.0:
            assert LineString([(x, y), end]).distance(path) < 0.5
        assert Point(x, y).distance(path) < 25.0


@pytest.mark.parametrize("name", ["pedestrians", "junction"])
def test_networks_without_pavements_need_jaywalkers(
    staged: Staged, bare: Callable[[str], Path], name: str
) -> None:
    """Without the option they are refused with what to do; with it they can be tested."""
    with pytest.raises(NetworkError, match=r"--sidewalks\.guess --crossings\.guess.*--jaywalk"):
        staged(net=bare(name))
    areas = staged(net=bare(name), jaywalk=True)[1].areas
    assert sum(area.end - area.begin for area in areas) > 50.0


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"kind": "car"}, "jaywalk: only pedestrians start beside the road"),
        ({"embodiment": "person"}, "jaywalk: embodiment person needs a pavement"),
        ({"jaywalk": "perhaps"}, "jaywalk: Input should be a valid boolean"),
    ],
)
def test_who_cannot_jaywalk_is_refused(
    staged: Staged, bare: Callable[[str], Path], settings: dict[str, str], words: str
) -> None:
    """Cars, persons of SUMO's without a pavement, what is neither true nor false."""
    with pytest.raises(InputError, match=words) as refused:
        staged(net=bare("pedestrians"), **{"jaywalk": True, **settings})
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "words",
    [["--ego-route", "lefft"], ["--ego-route", "u-turn"], ["--jaywalk", "--kind", "car"]],
)
def test_bad_options_are_one_sentence(
    refused: Callable[..., str], networks: dict[str, Path], words: list[str]
) -> None:
    """Exit status 2, nothing written."""
    refused("--net", str(networks["junction"]), *words)
