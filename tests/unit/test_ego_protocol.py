"""The protocol of egos from outside: what is said, what is understood, and its documentation."""

from __future__ import annotations

import dataclasses
import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from support import ROOT

from cavsumo.agents.base import Scene
from cavsumo.egos.base import EGO_KIND, Acceleration, Drive, Mission
from cavsumo.egos.effectors import checked
from cavsumo.egos.external import protocol
from cavsumo.errors import EgoError
from cavsumo.model.bodies import CAR, Body
from cavsumo.model.carriageway import Light, MarkedCrossing
from cavsumo.model.polyline import Path as Polyline
from cavsumo.model.snapshot import Snapshot
from cavsumo.model.surroundings import LaneBorders, RouteLane, Surroundings

DOCS = ROOT / "docs" / "ego-protocol.md"
LIGHTS = (Light("J1", 2, 40.0), Light("J2", 0, 80.0))
PATH = Polyline([(0.0, -1.825), (99.0, -1.825)])
ROAD = Surroundings(
    (RouteLane(0.0, 3.65, 13.89),),
    (LaneBorders("east_0", ((0.0, 0.0), (99.0, 0.0)), ((0.0, -3.65), (99.0, -3.65))),),
    (((0.0, -3.65), (99.0, -3.65), (99.0, -6.65), (0.0, -6.65)),),
)


@pytest.fixture
def scene(straight_scene: Callable[..., Scene]) -> Scene:
    """The straight road with two traffic lights and one pedestrian."""
    made = straight_scene()
    return Scene(made.dt, made.ego, PATH, made.bodies, made.starts, made.roads, LIGHTS, 7)


def observed(scene: Scene, snapshot: Snapshot, letters: str = "rG") -> dict[str, Any]:
    """An observation as the ego reads it."""
    line = protocol.Observations(scene).line(snapshot._replace(lights=tuple(letters)))
    assert line.endswith(b"}\n")
    assert line.count(b"\n") == 1
    message: dict[str, Any] = json.loads(line)
    return message


def test_a_hello_has_the_constants_of_the_scenario() -> None:
    """Timestep, limits, route and lights, in SI units; the network by its whole path."""
    mission = Mission(Path("networks/x.net.xml"), ("a", "b"), PATH, LIGHTS, 0.1, 60.0)
    said = json.loads(protocol.hello(mission, EGO_KIND))
    assert (said["type"], said["protocol"], said["version"]) == ("hello", "cavsumo-ego", 1)
    assert (said["timestep_s"], said["horizon_s"]) == (0.1, 60.0)
    assert said["ego"]["steering_max_rad"] == EGO_KIND.steering_max
    assert said["ego"]["acceleration_min_mps2"] == -9.0
    assert said["network"] == str(Path.cwd() / "networks/x.net.xml")
    route = {"edges": ["a", "b"], "points_m": [[0.0, -1.825], [99.0, -1.825]], "lanes": []}
    assert said["route"] == route
    assert said["traffic_lights"][1] == {"id": "J2", "stop_line_m": 80.0}


def test_a_hello_has_the_road_near_the_route() -> None:
    """Lanes with their borders, pavements, and crossings with the right of way."""
    zebra = shapely.box(40.0, -3.65, 44.0, 3.65)
    crossings = (
        MarkedCrossing("c1", 40.0, 44.0, zebra, None, True),
        MarkedCrossing("c2", 60.0, 64.0, zebra, ("J1", 3), False),
    )
    mission = Mission(
        Path("x.net.xml"), ("a",), PATH, (), 0.1, 60.0, crossings=crossings, surroundings=ROAD
    )
    said = json.loads(protocol.hello(mission, EGO_KIND))
    assert said["route"]["lanes"] == [
        {"from_m": 0.0, "width_m": 3.65, "speed_limit_mps": 13.89},
    ]
    left, right = [[0.0, 0.0], [99.0, 0.0]], [[0.0, -3.65], [99.0, -3.65]]
    assert said["lanes"] == [{"id": "east_0", "left_m": left, "right_m": right}]
    assert said["pavements_m"] == [[[0.0, -3.65], [99.0, -3.65], [99.0, -6.65], [0.0, -6.65]]]
    rights = [(c["id"], c["priority"], c["signalled"]) for c in said["crossings"]]
    assert rights == [("c1", True, False), ("c2", False, True)]
    assert (said["crossings"][1]["begin_m"], said["crossings"][1]["end_m"]) == (60.0, 64.0)
    corners = {(40.0, -3.65), (44.0, -3.65), (44.0, 3.65), (40.0, 3.65)}
    assert {tuple(point) for point in said["crossings"][0]["outline_m"]} == corners


def test_a_body_is_on_the_carriageway_by_its_centre(
    scene: Scene, scene_snapshot: Callable[..., Snapshot]
) -> None:
    """Whether it moves onto it, stands there or leaves it; on the open plane all are on it."""
    places = [(60.0, -5.15, 1.4, 1.57), (60.0, -3.5, 1.4, 1.57), (60.0, -3.5, 0.0, 1.57)]
    lines = protocol.Observations(scene)
    seen = [
        json.loads(lines.line(scene_snapshot(scene, (10.0, 8.0), [place], step=i)))["bodies"][0]
        for i, place in enumerate([*places, places[2], places[0]])
    ]
    assert [body["on_carriageway"] for body in seen] == [False, True, True, True, False]
    plane = dataclasses.replace(scene, roads=None)
    said = observed(plane, scene_snapshot(plane, (10.0, 8.0), [places[0]]))
    assert said["bodies"][0]["on_carriageway"] is True


def test_the_acceleration_is_that_of_the_last_timestep(
    scene: Scene, scene_snapshot: Callable[..., Snapshot]
) -> None:
    """Of its speeds in two observations; 0 in the first one of an episode."""
    lines = protocol.Observations(scene)
    speeds = 8.0, 7.5, 7.5, 7.75
    said = [
        json.loads(lines.line(scene_snapshot(scene, (10.0, v), step=i)))
        for i, v in enumerate(speeds)
    ]
    found = [message["ego"]["acceleration_mps2"] for message in said]
    assert found == pytest.approx([0.0, -5.0, 0.0, 2.5])


def test_every_number_reads_back_as_itself(
    scene: Scene, scene_snapshot: Callable[..., Snapshot]
) -> None:
    """Also the awkward ones, and those that come from numpy."""
    rng = np.random.default_rng(3)
    for _ in range(200):
        ego = tuple(rng.uniform(-3.2, 3.2, 4) * 10.0 ** rng.integers(-300, 3))
        tester = tuple(rng.normal(size=4) * 10.0 ** rng.integers(-12, 12))
        snapshot = scene_snapshot(scene, ego, [tester], step=3, steering=5e-324)
        said = observed(scene, snapshot)
        assert [said["ego"][k] for k in ("x_m", "y_m", "speed_mps", "heading_rad")] == list(ego)
        body = said["bodies"][0]
        assert [body[k] for k in ("x_m", "y_m", "speed_mps", "heading_rad")] == list(tester)
        assert said["ego"]["steering_rad"] == 5e-324


def test_an_observation_shows_everybody(
    scene: Scene, scene_snapshot: Callable[..., Snapshot]
) -> None:
    """Testers first, then the background, each with its size; ids may hold anything."""
    car = Body('a "car"\n', CAR)
    snapshot = scene_snapshot(scene, (10.0, 8.0), background=[(car, 50.0, 2.0, 5.0, math.pi)])
    said = observed(scene, snapshot)
    assert [b["id"] for b in said["bodies"]] == ["tester0", 'a "car"\n']
    assert said["bodies"][1] == {
        "id": 'a "car"\n',
        "kind": "car",
        "length_m": 4.5,
        "width_m": 1.75,
        "x_m": 50.0,
        "y_m": 2.0,
        "heading_rad": math.pi,
        "speed_mps": 5.0,
        "on_carriageway": True,
    }
    assert said["ego"]["along_m"] == 10.0
    assert said["ego"]["lateral_m"] == 0.0


@pytest.mark.parametrize(
    ("x", "light"),
    [
        (10.0, {"id": "J1", "distance_m": 27.75, "state": "red", "letter": "r"}),
        (37.75, {"id": "J1", "distance_m": 0.0, "state": "red", "letter": "r"}),
        (37.8, {"id": "J2", "distance_m": 39.95, "state": "green", "letter": "G"}),
        (78.0, None),
    ],
)
def test_the_light_shown_is_the_next_before_the_front_bumper(
    scene: Scene, scene_snapshot: Callable[..., Snapshot], x: float, light: Any
) -> None:
    """The ego is 4.5 m long; the stop lines lie at 40 and 80 m."""
    said = observed(scene, scene_snapshot(scene, (x, 8.0)))["traffic_light"]
    assert said == (light and light | {"distance_m": pytest.approx(light["distance_m"])})


def test_every_letter_of_sumo_has_a_word() -> None:
    """The letters of SUMO's documentation; what a later one may mean is not guessed."""
    assert set(protocol.LIGHTS) == set("ryYgGusoO")


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        (b'{"acceleration": -1.5}', Acceleration(-1.5)),
        (b' {"acceleration": 1, "note": "on my way", "step": 3}\r', Acceleration(1.0)),
        (b'{"steering": 0.1, "throttle": 2}', Drive(2.0, 0.1)),
    ],
)
def test_commands_are_understood(line: bytes, expected: Acceleration | Drive) -> None:
    """Both sorts, with fields that a later version may know."""
    assert protocol.command(line) == expected


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (b"", "answered '', expected a line of JSON"),
        (b"hello?", r"answered 'hello\?', expected a line of JSON"),
        (b"\xff\xfe", r"answered .*xff.*, expected a line of JSON"),
        (b"[" * 60000, r"answered '\[+\.\.\.', expected a line of JSON"),
        (b"[1.0]", r"answered '\[1.0\]', expected a JSON object"),
        (b"null", "answered 'null', expected a JSON object"),
        (b'{"accel": 1}', "expected either acceleration or throttle and steering"),
        (b'{"acceleration": 1, "steering": 0}', "expected either acceleration or throttle and"),
        (b'{"throttle": 1}', "steering must be a number, got nothing"),
        (b'{"acceleration": "1"}', "acceleration must be a number, got '1'"),
        (b'{"acceleration": true}', "acceleration must be a number, got True"),
        (b'{"acceleration": null}', "acceleration must be a number, got None"),
        (b'{"acceleration": NaN}', r"acceleration must lie in \[-9, 9\], got nan"),
        (b'{"acceleration": -Infinity}', r"acceleration must lie in \[-9, 9\], got -inf"),
        (b'{"acceleration": 1e999}', r"acceleration must lie in \[-9, 9\], got inf"),
        (b'{"acceleration": -1%s}' % (b"0" * 400), r"acceleration must lie .*, got -inf"),
        (b'{"acceleration": 1%s}' % (b"0" * 5000), "expected a line of JSON"),
        (b'{"acceleration": 9.5}', r"acceleration must lie in \[-9, 9\], got 9.5"),
        (b'{"throttle": 1, "steering": 2}', r"steering must lie in \[-0.628319, 0.628319\]"),
        (b'{"error": "no map of this place"}', "gave up: 'no map of this place'"),
    ],
    ids=lambda x: x[:24].decode("latin1") if isinstance(x, bytes) else "",
)
def test_what_is_no_command_is_said_in_one_short_line(line: bytes, words: str) -> None:
    """Whatever comes, the message quotes no more than a little of it."""
    with pytest.raises(EgoError, match=words) as caught:
        _checked(line)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 200


def _checked(line: bytes) -> None:
    """A reply taken as the ego takes it."""
    command = protocol.command(line)
    checked(command, None, EGO_KIND, protocol.names(command))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (
            b'{"type": "hello", "version": 2}',
            "speaks version 2 of the protocol, expected version 1",
        ),
        (b'{"type": "hello", "version": "1"}', "speaks version '1' of the protocol"),
        (b'{"type": "hello", "version": true}', "speaks version True of the protocol"),
        (b'{"type": "hello"}', "speaks no version of the protocol"),
        (b'{"type": "ready"}', 'expected an object of "type" "hello"'),
        (b"{}", 'expected an object of "type" "hello"'),
    ],
)
def test_a_hello_in_another_version_is_refused(line: bytes, words: str) -> None:
    """A version is a number, and there is one so far."""
    with pytest.raises(EgoError, match=words):
        protocol.check_hello(line)


def test_the_documented_exchange_is_what_is_really_said(
    scene: Scene, scene_snapshot: Callable[..., Snapshot]
) -> None:
    """The lines of the example in the documentation, made again and understood."""
    block = re.search(r"<!-- exchange -->\n```\n(.*?)```", DOCS.read_text(), re.DOTALL)
    assert block
    said = re.findall(r"^([<>]) (.*)$", block[1], re.MULTILINE)
    ours = [json.loads(text) for side, text in said if side == ">"]
    replies = [text.encode() for side, text in said if side == "<"]
    mission = Mission(
        Path("/home/me/networks/road.net.xml"),
        ("east",),
        PATH,
        LIGHTS[:1],
        0.1,
        60.0,
        surroundings=ROAD,
    )
    scene = dataclasses.replace(scene, lights=LIGHTS[:1])
    lines = protocol.Observations(scene)
    now = scene_snapshot(scene, (10.0, 8.0), [(60.0, -5.15, 1.4, math.pi / 2)])._replace(
        lights=("r",)
    )
    then = scene_snapshot(scene, (10.75, 7.5), step=1)._replace(lights=("r",), testers=())
    expected = [
        protocol.hello(mission, EGO_KIND),
        protocol.reset(7),
        lines.line(now),
        lines.line(then),
        protocol.CLOSE,
    ]
    assert ours == [json.loads(line) for line in expected]
    protocol.check_hello(replies[0])
    protocol.check_ready(replies[1])
    assert [protocol.command(line) for line in replies[2:]] == [
        Acceleration(-5.0),
        Acceleration(1.5),
    ]
