"""Episodes as OpenSCENARIO: everybody's reference point, box and track; played by esmini."""

from __future__ import annotations

import csv
import math
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from inline import cavsumo as command

from cavsumo.errors import Exit
from cavsumo.interop.openscenario import axle, held, reference_point, tracks
from cavsumo.results.reading import read_rows
from cavsumo.results.traces import Shape, Trace, read_trace

pytest.importorskip("scenariogeneration", reason="pip install 'cavsumo[export]'")
ESMINI = shutil.which("esmini")
CAR = Shape("car", 4.5, 1.75, 3.0)


@pytest.fixture(scope="module")
def exported(
    found_failure: Path, tmp_path_factory: pytest.TempPathFactory, inline: None
) -> tuple[Path, Trace]:
    """A folder with a failure as OpenSCENARIO, and its trace."""
    folder = tmp_path_factory.mktemp("exported")
    row = next(row for row in read_rows(found_failure) if row["outcome"] == "violated")
    words = [str(found_failure), row["run"], "--to", "openscenario", "-o", "."]
    done = command(folder, "export", *words)
    assert done.returncode == 0, done.stderr
    return folder, read_trace(found_failure.parent / row["trace"])


def test_the_reference_point_is_on_the_rear_axle() -> None:
    """Of a vehicle; within its box, also of the bus whose wheelbase is longer; not on foot."""
    assert reference_point(CAR, (10.0, 5.0, 1.0, math.pi / 2)) == pytest.approx(
        (10.0, 3.5, math.pi / 2)
    )
    assert axle(Shape("bus", 12.0, 2.55, 16.875)) == 6.0
    assert axle(Shape("pedestrian", 0.66, 0.88, 0.33)) == 0.0


def test_headings_are_held_around_each_timestep() -> None:
    """Three points each, two at the ends, all on the way."""
    track = [(0.0, 0.0, 0.0, 0.0), (0.1, 1.0, 0.0, 0.5), (0.2, 1.0, 2.0, 0.7)]
    points = held(track)
    assert [round(point[0], 4) for point in points] == [0.0, 0.001, 0.099, 0.1, 0.101, 0.199, 0.2]
    assert [point[3] for point in points] == [0.0, 0.0, 0.5, 0.5, 0.5, 0.7, 0.7]
    assert points[2][1:3] == pytest.approx((0.99, 0.0))
    assert points[4][1:3] == pytest.approx((1.0, 0.02))


def test_everybody_is_in_it(exported: tuple[Path, Trace]) -> None:
    """Boxes, first places and times as recorded; no date, no path of this machine."""
    folder, trace = exported
    root = ET.parse(folder / "test.xosc").getroot()
    whole, partial = tracks(trace)
    assert {"ego", "tester0", "tester1", "tester2"} <= whole.keys()
    names = {one.get("name"): one for one in root.iter("ScenarioObject")}
    assert names.keys() == whole.keys()
    assert not names.keys() & {*partial}
    box = names["ego"].find(".//BoundingBox")
    assert box is not None
    assert [float(value) for value in box[0].attrib.values()] == [1.5, 0.0, 0.75]
    for group in root.iter("ManeuverGroup"):
        track = whole[str(next(group.iter("EntityRef")).get("entityRef"))]
        times = [float(str(vertex.get("time"))) for vertex in group.iter("Vertex")]
        assert len(times) == 3 * len(track) - 2
        assert (times[0], times[-1]) == (track[0][0], track[-1][0])
    text = (folder / "test.xodr").read_text("utf-8")
    assert "OpenStreetMap" in text
    assert "/tmp" not in text
    assert 'date="2000-01-01T00:00:00"' in text


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
    line = f"{ESMINI} --osc test.xosc --headless --fixed_timestep 0.01 --csv_logger out.csv"
    more = "--collision --traj_filter 0 --logfile_path log.txt"
    done = subprocess.run(
        [*line.split(), *more.split()], cwd=folder, capture_output=True, timeout=200, check=False
    )
    assert done.returncode == 0
    whole, _ = tracks(trace)
    compared = 0
    for row in list(csv.reader((folder / "out.csv").open(encoding="utf-8"))):
        cells = [cell.strip() for cell in row]
        step = round(float(cells[1]) / 0.1) if len(cells) > 20 and cells[0].isdecimal() else None
        if step is None or abs(float(cells[1]) - step * 0.1) > 1e-6:
            continue
        for at in [i for i, cell in enumerate(cells) if cell in whole]:
            if step < len(whole[cells[at]]):
                _, x, y, o = whole[cells[at]][step]
                east, north = _offset(folder)
                place = float(cells[at + 11]) - east, float(cells[at + 12]) - north
                assert math.dist(place, (x, y)) < 0.02
                assert abs(math.remainder(float(cells[at + 24]) - o, math.tau)) < 0.01
                compared += 1
    assert compared > len(trace.frames)
    log = (folder / "log.txt").read_text(encoding="utf-8")
    hits = re.findall(r"\[([\d.]+)\] \[warn\] Collision between ego and (\w+)", log)
    when = {name: float(time) for time, name in hits}[trace.row["tester"]]
    assert abs(when - float(trace.row["violation_time_s"])) <= 0.1 + 1e-6


def _offset(folder: Path) -> tuple[float, float]:
    """The offset of the road's coordinates, which esmini adds in its output."""
    text = (folder / "test.xodr").read_text("utf-8")
    found = re.search(r'<offset x="([-\d.e+]+)" y="([-\d.e+]+)"', text)
    return (float(found[1]), float(found[2])) if found else (0.0, 0.0)


def test_what_cannot_be_exported_is_refused(
    found_failure: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No trace, no folder: one sentence, and nothing is written."""
    words = ["export", str(found_failure), "0", "--to", "openscenario", "-o"]
    for done, said in (
        (command(tmp_path, *words, "nowhere"), "--output 'nowhere': no such folder"),
        (command(tmp_path, *words, ".", "--net", "gone.net.xml"), "no such file"),
    ):
        assert (done.returncode, done.stderr.count("\n")) == (Exit.USAGE, 1), done.stderr
        assert said in done.stderr
    monkeypatch.setattr("cavsumo.cli.requests.kept.find_spec", lambda name: None)
    done = command(tmp_path, *words, ".")
    assert "pip install 'cavsumo[export]'" in done.stderr
    assert list(tmp_path.iterdir()) == []
