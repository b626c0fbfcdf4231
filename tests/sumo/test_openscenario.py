"""Episodes as OpenSCENARIO: everybody's reference point, box and track; played by esmini."""

from __future__ import annotations

import math
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from exporting import export_as_test, export_failure
from inline import cavsumo as command
from support import benchmark

from cavsumo.errors import Exit
from cavsumo.interop.storyboard_parts import held
from cavsumo.interop.tracks import TrackPoint, at_axle, axle, driven, stays
from cavsumo.results.traces import Shape, Trace

pytest.importorskip("scenariogeneration", reason="pip install 'cavsumo[export]'")
ESMINI = shutil.which("esmini")
CAR = Shape("car", 4.5, 1.75, 3.0)
exports = benchmark("exports")


@pytest.fixture(scope="module")
def exported(
    found_failure: Path, tmp_path_factory: pytest.TempPathFactory, inline: None
) -> tuple[Path, Trace]:
    """A folder with a failure as OpenSCENARIO, and its trace."""
    folder = tmp_path_factory.mktemp("exported")
    return folder, export_failure(folder, found_failure, ["openscenario"])


def test_the_reference_point_is_on_the_rear_axle() -> None:
    """Of a vehicle; within its box, also of the bus whose wheelbase is longer; not on foot."""
    north = TrackPoint(0.0, 10.0, 5.0, math.pi / 2, 1.0)
    assert at_axle(CAR, [north])[0][1:4] == pytest.approx((10.0, 3.5, math.pi / 2))
    assert axle(Shape("bus", 12.0, 2.55, 16.875)) == 6.0
    assert axle(Shape("pedestrian", 0.66, 0.88, 0.33)) == 0.0


def test_headings_are_held_around_each_timestep() -> None:
    """Three points each, two at the ends, all on the way."""
    track = [
        TrackPoint(0.0, 0.0, 0.0, 0.0, 0.0),
        TrackPoint(0.1, 1.0, 0.0, 0.5, 0.0),
        TrackPoint(0.2, 1.0, 2.0, 0.7, 0.0),
    ]
    points = held(track)
    times = [round(point.time, 4) for point in points]
    assert times == [0.0, 0.001, 0.099, 0.1, 0.101, 0.199, 0.2]
    assert [point.heading for point in points] == [0.0, 0.0, 0.5, 0.5, 0.5, 0.7, 0.7]
    assert points[2][1:3] == pytest.approx((0.99, 0.0))
    assert points[4][1:3] == pytest.approx((1.0, 0.02))


def test_everybody_is_in_it(exported: tuple[Path, Trace]) -> None:
    """Boxes, first places and times as recorded; no date, no path of this machine."""
    folder, trace = exported
    root = ET.parse(folder / "test.xosc").getroot()
    bodies = {body.name: body for body in stays(trace)}
    assert {"ego", "tester0", "tester1", "tester2"} <= bodies.keys()
    assert any(body.late or body.early for body in bodies.values())
    names = {one.get("name"): one for one in root.iter("ScenarioObject")}
    assert names.keys() == bodies.keys()
    box = names["ego"].find(".//BoundingBox")
    assert box is not None
    assert [float(value) for value in box[0].attrib.values()] == [1.5, 0.0, 0.75]
    for group in root.iter("ManeuverGroup"):
        track = bodies[str(next(group.iter("EntityRef")).get("entityRef"))].tracks[0]
        times = [float(str(vertex.get("time"))) for vertex in group.iter("Vertex")]
        assert len(times) == max(2, 3 * len(track) - 2)
        assert times[0] == track[0].time
        assert len(track) == 1 or times[-1] == track[-1].time
    for name in ("test.xosc", "test.xodr"):
        text = (folder / name).read_text("utf-8")
        assert "OpenStreetMap" in text
        assert "/tmp" not in text
        assert 'date="2000-01-01T00:00:00"' in text


def test_bodies_come_and_go(exported: tuple[Path, Trace]) -> None:
    """One that enters late is added then, one that leaves early deleted behind its last frame."""
    folder, trace = exported
    root = ET.parse(folder / "test.xosc").getroot()
    added = [str(one.get("entityRef")) for one in root.iter("EntityAction")
             if one.find("AddEntityAction") is not None]  # fmt: skip
    bodies = stays(trace)
    assert sorted(added) == sorted(body.name for body in bodies if body.late)
    deleted = [str(one.get("entityRef")) for one in root.iter("EntityAction")
               if one.find("DeleteEntityAction") is not None]  # fmt: skip
    gone = [body.name for body in bodies if body.early] + added  # late ones, at the beginning too
    assert sorted(deleted) == sorted(gone)


def test_as_a_test_the_ego_is_left_to_the_player(
    exported: tuple[Path, Trace], found_failure: Path, tmp_path: Path
) -> None:
    """It has a speed and a route; testers wait until it has come as far as it had."""
    _, trace = exported
    root = export_as_test(tmp_path, found_failure, trace, "openscenario", "test.xosc")
    groups = {
        next(one.iter("EntityRef")).get("entityRef"): one for one in root.iter("ManeuverGroup")
    }
    assert "ego" not in groups
    begin = next(one for one in root.iter("Private") if one.get("entityRef") == "ego")
    speed = next(begin.iter("AbsoluteTargetSpeed")).get("value")
    assert float(str(speed)) == trace.frames[0]["ego"][2]
    assert len(list(begin.iter("Waypoint"))) >= 2
    bodies = {body.name: body for body in stays(trace)}
    ego = at_axle(bodies["ego"].shape, bodies["ego"].tracks[0])
    waiting = 0
    for name in trace.frames[0]["testers"]:
        track = bodies[name].tracks[0]
        stood = [i for i, one in enumerate(track) if one.speed < 1e-3]
        if stood and stood[-1] < len(track) - 1:
            came = next(groups[name].iter("TraveledDistanceCondition")).get("value")
            assert float(str(came)) == driven(ego)[stood[-1]]
            waiting += 1
    assert waiting == len(list(root.iter("TraveledDistanceCondition")))


def test_the_same_bytes(exported: tuple[Path, Trace], found_failure: Path, tmp_path: Path) -> None:
    """Exported once more."""
    folder, trace = exported
    words = [str(found_failure), trace.row["run"], "--to", "openscenario", "-o", "."]
    assert command(tmp_path, "export", *words).returncode == 0
    for name in ("test.xosc", "test.xodr"):
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()


@pytest.mark.skipif(ESMINI is None, reason="no esmini here")
def test_esmini_plays_it(exported: tuple[Path, Trace]) -> None:
    """Within 2 cm and 0.01 rad at every timestep; the same pair collides within one timestep."""
    folder, trace = exported
    assert ESMINI is not None
    far, turned, compared, missing = exports.deviations(trace, exports.play(folder, ESMINI))
    assert (far < 0.02, turned < 0.01, missing) == (True, True, 0)
    assert compared > len(trace.frames)
    when = exports.collisions(folder)[trace.row["tester"]]
    assert abs(when - float(trace.row["violation_time_s"])) <= 0.1 + 1e-6


def test_what_cannot_be_exported_is_refused(
    found_failure: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No trace, no folder: one sentence, and nothing is written."""
    words = ["export", str(found_failure), "0", "--to", "openscenario", "-o"]
    for done, said in (
        (command(tmp_path, *words, "no/where"), "--output 'no/where': no such folder 'no'"),
        (command(tmp_path, *words, str(found_failure)), "is a file; expected a folder"),
        (command(tmp_path, *words, "new", "--net", "gone.net.xml"), "no such file"),
    ):
        assert (done.returncode, done.stderr.count("\n")) == (Exit.USAGE, 1), done.stderr
        assert said in done.stderr
    monkeypatch.setattr("cavsumo.cli.requests.kept.find_spec", lambda name: None)
    done = command(tmp_path, *words, ".")
    assert "pip install 'cavsumo[export]'" in done.stderr
    assert list(tmp_path.iterdir()) == []
