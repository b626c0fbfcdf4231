"""Exported episodes read again: the same tracks, the same verdict; CommonRoad's format."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from exporting import export_as_test, export_failure
from inline import cavsumo as command
from support import benchmark

from cavsumo.errors import Exit
from cavsumo.results.traces import Trace, read_trace, states

pytest.importorskip("scenariogeneration", reason="pip install 'cavsumo[export]'")
alike = benchmark("exports").alike
FILES = {"openscenario": "test.xosc", "commonroad": "test.xml"}


@pytest.fixture(scope="module")
def exported(
    found_failure: Path, tmp_path_factory: pytest.TempPathFactory, inline: None
) -> tuple[Path, Trace]:
    """A folder with a failure in both formats, and its trace."""
    folder = tmp_path_factory.mktemp("exported")
    return folder, export_failure(folder, found_failure, FILES)


@pytest.mark.parametrize("name", FILES.values())
def test_an_export_becomes_the_same_episode(
    exported: tuple[Path, Trace], tmp_path: Path, name: str
) -> None:
    """All bodies at the same places, the same verdict; shown, and exported once more."""
    folder, trace = exported
    net = str(trace.head["plan"]["scenario"]["net"])
    words = "import", str(folder / name), "--net", net, "-o", "again.jsonl.gz"
    done = command(tmp_path, *words)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(f"run {trace.row['run']} ({trace.row['agent']}): violated, ")
    assert done.stdout.splitlines()[0].endswith(
        f"with {trace.row['tester']} at {trace.row['violation_time_s']} s: as in the file"
    )
    again = read_trace(tmp_path / "again.jsonl.gz")
    assert len(again.frames) == len(trace.frames)
    assert all(alike(a, b) for a, b in zip(trace.frames, again.frames, strict=True))
    assert again.shapes() == trace.shapes()
    assert again.row == trace.row
    shown = command(tmp_path, "replay", "again.jsonl.gz", "--recorded", "--html", "again.html")
    assert shown.returncode == 0, shown.stderr
    done = command(tmp_path, "export", "again.jsonl.gz", "--to", "commonroad", "-o", ".")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    "words",
    [
        ("replay", "again.jsonl.gz"),
        ("replay", "again.jsonl.gz", "--html", "new.html"),
        ("replay", "again.jsonl.gz", "--playback"),
        ("keep", "again.jsonl.gz", "-o", "new.cavtest"),
        ("minimise", "again.jsonl.gz", "-o", "new.cavtest"),
    ],
)
def test_an_import_is_shown_and_not_played(
    exported: tuple[Path, Trace], tmp_path: Path, words: tuple[str, ...]
) -> None:
    """One sentence says what it is and what to type, and nothing is written."""
    folder, trace = exported
    file, net = str(folder / "test.xosc"), str(trace.head["plan"]["scenario"]["net"])
    done = command(tmp_path, "import", file, "--net", net, "-o", "again.jsonl.gz")
    assert done.returncode == 0, done.stderr
    done = command(tmp_path, *words)
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1] == (
        "cavsumo: trace 'again.jsonl.gz': has tracks without actions, as imported episodes have, "
        "so nothing plays it again; show it with: "
        "cavsumo replay again.jsonl.gz --recorded --html FILE"
    )
    assert [one.name for one in tmp_path.iterdir()] == ["again.jsonl.gz"]


def test_another_track_is_another_verdict(exported: tuple[Path, Trace], tmp_path: Path) -> None:
    """Without the collision at its end nothing was violated; the file says otherwise."""
    folder, trace = exported
    root = ET.parse(folder / "test.xml").getroot()
    text = (folder / "test.xml").read_text("utf-8")
    number = next(
        number for number, name in json.loads(_head(text))["ids"].items()
        if name == trace.row["tester"]
    )  # fmt: skip
    for body in root.findall("dynamicObstacle"):
        if body.get("id") == number:
            for place in body.iter("point"):
                place[0].text = str(float(str(place[0].text)) + 60.0)
    moved = tmp_path / "moved.xml"
    comment = f"<!-- cavsumo.head {_head(text)} -->"
    moved.write_text(f"{comment}\n{ET.tostring(root, encoding='unicode')}", encoding="utf-8")
    net = str(trace.head["plan"]["scenario"]["net"])
    done = command(tmp_path, "import", "moved.xml", "-n", net, "-o", "moved.jsonl.gz")
    assert done.returncode == 0, done.stderr
    assert "the file says violated" in done.stdout
    row = read_trace(tmp_path / "moved.jsonl.gz").row
    assert row["outcome"] != "violated" or row["tester"] != trace.row["tester"]
    assert row["avoidable"] == ""


def _head(text: str) -> str:
    """The settings in a CommonRoad file."""
    found = re.search(r"<!-- cavsumo\.head (.*?) -->", text)
    assert found is not None
    return found[1]


def _there(frame: Mapping[str, Any], name: str) -> bool:
    """Whether a body is in a frame."""
    return name in {known for _, known, _ in states(frame)}


def test_commonroad_has_lanelets_obstacles_and_a_problem(exported: tuple[Path, Trace]) -> None:
    """References lead to lanelets; the attribution; the ego's first state; no exponents."""
    folder, trace = exported
    text = (folder / "test.xml").read_text("utf-8")
    assert "OpenStreetMap" in text
    assert "/tmp" not in text
    root = ET.fromstring(text)
    assert (root.get("commonRoadVersion"), root.get("timeStepSize")) == ("2020a", "0.1")
    ids = {lanelet.get("id") for lanelet in root.findall("lanelet")}
    assert len(ids) > 20
    links = [one for lanelet in root.findall("lanelet") for one in lanelet if one.get("ref")]
    assert {one.tag for one in links} >= {"predecessor", "successor", "adjacentLeft"}
    assert {one.get("ref") for one in links} <= ids
    for lanelet in root.findall("lanelet"):
        assert len(list(lanelet[0])) == len(list(lanelet[1]))
    begins = [body.findtext("initialState/time/exact") for body in root.iter("dynamicObstacle")]
    assert {*begins} == {"0"}  # the schema wants that, also of the background that enters later
    late = [name for name in trace.shapes() if not _there(trace.frames[0], name)]
    assert late
    problem = root.find("planningProblem/initialState")
    assert problem is not None
    x, y, speed, _ = trace.frames[0]["ego"]
    assert float(str(problem.findtext("position/point/x"))) == pytest.approx(x)
    assert float(str(problem.findtext("position/point/y"))) == pytest.approx(y)
    assert float(str(problem.findtext("velocity/exact"))) == pytest.approx(speed)
    assert not re.search(r">-?\d[\d.]*e", text)


def test_as_a_test_the_ego_is_no_obstacle(
    exported: tuple[Path, Trace], found_failure: Path, tmp_path: Path
) -> None:
    """It is the planner's; such a file cannot be imported, for the ego has no track."""
    _, trace = exported
    root = export_as_test(tmp_path, found_failure, trace, "commonroad", "test.xml")
    bodies = len(trace.shapes())
    assert len(root.findall("dynamicObstacle")) == bodies - 1
    done = command(tmp_path, "import", "test.xml", "-o", "again.jsonl.gz")
    assert (done.returncode, done.stderr.count("\n")) == (Exit.USAGE, 1)
    assert "it is a test, in which the ego has no track" in done.stderr


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("<OpenSCENARIO/>", "it was not exported by cavsumo"),
        ("<commonRoad/>", "it was not exported by cavsumo"),
        ("<net/>", "<net>, expected <OpenSCENARIO> or <commonRoad>"),
        ("<net>", "line 1: no XML"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><a/>', "declares a document type"),
        ('<commonRoad/><!-- cavsumo.head {"way": "recorded"} -->', "lacks"),
        ("<!-- cavsumo.head [[[ --><commonRoad/>", "test.xml"),
    ],
)
def test_files_of_others_are_refused(tmp_path: Path, content: str, said: str) -> None:
    """In one sentence, and nothing is written."""
    (tmp_path / "test.xml").write_text(content, encoding="utf-8")
    done = command(tmp_path, "import", "test.xml", "-o", "again.jsonl.gz")
    assert (done.returncode, done.stderr.count("\n")) == (Exit.USAGE, 1), done.stderr
    assert said in done.stderr
    assert [file.name for file in tmp_path.iterdir()] == ["test.xml"]


def test_another_network_is_refused(exported: tuple[Path, Trace], tmp_path: Path) -> None:
    """Its checksum is in the file."""
    folder, _ = exported
    words = "import", str(folder / "test.xml"), "--net", "pedestrians", "-o", "a.jsonl.gz"
    done = command(tmp_path, *words)
    assert (done.returncode, done.stderr.count("\n")) == (Exit.USAGE, 1)
    assert "sha256" in done.stderr
    assert list(tmp_path.iterdir()) == []
