"""What cavsumo inspect says of a network, and that cavsumo run agrees."""

from __future__ import annotations

import html
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support import ROOT

from cavsumo.cli import main
from cavsumo.model.polyline import Path as Polyline
from cavsumo.network.drawing import layers
from cavsumo.network.ego_routes import _turns_back, ranked_routes
from cavsumo.network.facts import facts
from cavsumo.network.inspection import best_junctions, ground, junction
from cavsumo.network.movements import movements
from cavsumo.network.reader import read_network
from cavsumo.network.site import best_route

HALF_M = 2.25
Capture = pytest.CaptureFixture[str]
Staged = Callable[..., Any]
ALL = pytest.mark.parametrize("name", ["pedestrians", "crossing", "junction"])

needs_netconvert = pytest.mark.usefixtures("netconvert")


@pytest.fixture(scope="module")
def grid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A town of 144 junctions and 528 edges, with pavements and crossings."""
    import cavsumo.network.osm.netconvert as program

    file = tmp_path_factory.mktemp("grid") / "grid.net.xml"
    tool = program.sumo_home() / "bin" / "netgenerate"
    words = "--grid --grid.number 12 --grid.length 120 --sidewalks.guess --crossings.guess -o"
    subprocess.run([tool, *words.split(), file], check=True, capture_output=True)
    return file


def _looked(capsys: Capture, *words: str) -> dict[str, Any]:
    """The JSON of cavsumo inspect."""
    assert main(["inspect", *words, "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


@pytest.mark.parametrize(
    ("name", "edges", "crossings", "lights", "signals"),
    [("crossing", 24, 14, 0, 0), ("junction", 29, 19, 3, 11), ("pedestrians", 2, 0, 0, 0)],
)
def test_facts_are_those_of_the_readme(
    networks: dict[str, Path], name: str, edges: int, crossings: int, lights: int, signals: int
) -> None:
    """Edges, crossings and traffic lights as networks/README.md has them; all keep right."""
    found = facts(read_network(networks[name]))
    assert (found.edges, found.crossings, found.traffic_lights) == (edges, crossings, lights)
    assert found.crossings_with_signals == signals
    assert found.crossings_with_priority == 0
    assert found.crossings_without_priority == crossings - signals
    assert (found.pavements, found.components, found.left_hand) == (edges, 1, False)
    assert found.format == "1.20"


def test_the_georeference_is_shown_as_latitude_and_longitude(networks: dict[str, Path]) -> None:
    """Helsinki lies at 60 north, 25 east; our own road lies nowhere."""
    pytest.importorskip("pyproj")
    network = read_network(networks["crossing"])
    looked = junction(ground(network, HALF_M), network.junction("4435014132"))
    assert looked.centre == pytest.approx((60.16988, 24.94924), abs=2e-5)
    assert facts(read_network(networks["pedestrians"])).centre is None


@ALL
def test_run_chooses_what_inspect_ranks_first(
    networks: dict[str, Path], staged: Staged, name: str
) -> None:
    """The first way through the first junction is the default ego route, with its areas."""
    site = staged(name)[1]
    best = best_junctions(ground(read_network(networks[name]), HALF_M), 1)
    if not best:
        assert site.route.junction is None
        return
    assert best[0].id == site.route.junction
    assert best[0].ways[0].route.edges == site.route.edges
    areas = [
        [(area.walk, area.begin, area.end) for area in found]
        for found in (best[0].ways[0].areas, site.areas)
    ]
    assert areas[0] == areas[1]


def test_turns_are_told_by_geometry(networks: dict[str, Path]) -> None:
    """At Yliopistonkatu and Fabianinkatu, seen from the west: on to the east, left is north."""
    network = read_network(networks["crossing"])
    ways = {m.out.getID(): m for m in movements(network.junction("4435014132"))}
    assert {m.turn for m in ways.values()} <= {"straight", "left", "right", "u-turn"}
    node = network.junction("4435014132")
    turns = {(str(m.into.getID()), str(m.out.getID())): m.turn for m in movements(node)}
    assert turns["127809159#2", "36730335#1"] == "straight"
    assert turns["-232008578", "36730335#1"] == "right"
    x, y = node.getCoord()[:2]
    for (into, out), turn in turns.items():
        (ax, ay), (bx, by) = (
            network.edge(into).getLanes()[1].getShape()[0],
            network.edge(out).getLanes()[1].getShape()[-1],
        )
        side = (x - ax) * (by - y) - (y - ay) * (bx - x)
        if turn in ("left", "right"):
            assert (side > 0) == (turn == "left"), (into, out)


def test_every_way_comes_with_crossings_and_areas(networks: dict[str, Path]) -> None:
    """Straight through the crossroads the ego meets the two crossings of its arms."""
    looked = best_junctions(ground(read_network(networks["crossing"]), HALF_M), 1)[0]
    assert looked.crossings == 4
    straight = [way for way in looked.ways if way.turn == "straight"]
    assert len(straight) == 4
    for way in straight:
        assert len(way.crossings) >= 2
        assert way.areas
        assert way.area_m > 20.0


def test_routes_along_zigzag_lanes_come_last(networks: dict[str, Path]) -> None:
    """A corner in which a path goes back is found; the shipped networks have none."""
    assert _turns_back(Polyline([(0, 0), (30, 0), (25, 1), (60, 1)]))
    assert not _turns_back(Polyline([(0, 0), (30, 0), (31, 2), (31, 30)]))
    routes = list(ranked_routes(read_network(networks["crossing"]), None, HALF_M))
    assert not any(_turns_back(route.path) for _, route in routes)


# What is printed


def test_json_has_the_documented_keys(networks: dict[str, Path], capsys: Capture) -> None:
    """The keys are those of docs/inspect.md; a change of them needs a new format."""
    found = _looked(capsys, str(networks["crossing"]), "--top", "2")
    documented = (ROOT / "docs" / "inspect.md").read_text(encoding="utf-8")
    assert set(found) == {"format", "network", "facts", "junctions"}
    assert found["format"] == 1
    assert [j["rank"] for j in found["junctions"]] == [1, 2]
    first = found["junctions"][0]
    way = first["ways"][0]
    for part in (found, found["facts"], first, way, way["starting_areas"][0]):
        for key in part:
            assert f"`{key}`" in documented, key


def test_the_table_names_streets_junctions_and_the_next_command(
    networks: dict[str, Path], capsys: Capture
) -> None:
    """Everything the user needs for the next step, in UTF-8, ids whole."""
    net = str(networks["junction"])
    assert main(["inspect", net, "--junction", "25291565"]) == 0
    out = capsys.readouterr().out
    assert "1. junction 25291565 (Annankatu, Bulevardi): traffic_light, 4 crossings" in out
    assert "19: 11 at traffic lights, 0 with priority, 8 without" in out
    assert f"cavsumo run --net {net} --junction 25291565" in out


def test_strange_ids_and_names_survive(
    networks: dict[str, Path], tmp_path: Path, capsys: Capture
) -> None:
    """Brackets, hashes, hyphens and Chinese characters in ids and names."""
    text = networks["crossing"].read_text(encoding="utf-8")
    text = text.replace("4435014132", "cluster_1_2_#3more[bold]").replace(
        "Fabianinkatu", "花园[red]街"
    )
    net = tmp_path / "odd.net.xml"
    net.write_text(text, encoding="utf-8")
    found = _looked(capsys, str(net), "--top", "1")
    assert found["junctions"][0]["id"] == "cluster_1_2_#3more[bold]"
    assert "花园[red]街" in found["junctions"][0]["streets"]
    assert main(["inspect", str(net), "--junction", "cluster_1_2_#3more[bold]"]) == 0
    out = capsys.readouterr().out
    assert "junction cluster_1_2_#3more[bold] (Yliopistonkatu, 花园[red]街)" in out


@pytest.mark.parametrize("words", [[], ["--json"]])
def test_a_narrow_terminal_encoding_is_no_error(
    networks: dict[str, Path], tmp_path: Path, words: list[str]
) -> None:
    """Letters that stdout cannot write are escaped; JSON stays JSON."""
    net = tmp_path / "odd.net.xml"
    text = networks["pedestrians"].read_text(encoding="utf-8")
    net.write_text(text.replace("eastbound", "东行"), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "cavsumo", "inspect", str(net), *words],
        capture_output=True,
        check=True,
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
    )
    assert done.stderr == b""
    if words:
        assert json.loads(done.stdout)["facts"]["edges"] == 2


def test_without_pyproj_it_says_what_brings_it(
    networks: dict[str, Path], capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The centre is left out, everything else is there."""
    monkeypatch.setattr("cavsumo.network.facts.find_spec", lambda name: None)
    found = _looked(capsys, str(networks["crossing"]), "--top", "1")
    assert found["facts"]["centre"] is None
    assert any("pip install 'cavsumo[osm]' brings pyproj" in n for n in found["facts"]["notes"])


# A picture


def test_a_picture_is_drawn_without_a_screen(
    networks: dict[str, Path], tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A PNG of the best junction; the same again is the same bytes; pyplot is not needed."""
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delitem(sys.modules, "matplotlib.pyplot", raising=False)  # of another test
    files = [tmp_path / "a.png", tmp_path / "b.png"]
    for file in files:
        assert (
            main(["inspect", str(networks["crossing"]), "--top", "1", "--picture", str(file)]) == 0
        )
    assert files[0].read_bytes().startswith(b"\x89PNG")
    assert files[0].stat().st_size > 20_000
    assert files[0].read_bytes() == files[1].read_bytes()
    assert "matplotlib.pyplot" not in sys.modules
    road = tmp_path / "road.svg"
    assert main(["inspect", str(networks["pedestrians"]), "--picture", str(road)]) == 0
    assert road.stat().st_size > 1000


def _renamed(networks: dict[str, Path], folder: Path, name: str) -> Path:
    """The crossing with another name of its street from north to south."""
    net = folder / "renamed.net.xml"
    text = networks["crossing"].read_text(encoding="utf-8").replace("Fabianinkatu", name)
    net.write_text(text, encoding="utf-8")
    return net


def _written(svg: Path) -> list[str]:
    """The texts of a picture; matplotlib says each in a comment before it draws its letters."""
    found = re.findall(r"<!-- (.*?) -->", svg.read_text(encoding="utf-8"), re.DOTALL)
    return [html.unescape(text) for text in found]


def test_a_picture_has_a_title_and_the_names_of_streets(
    networks: dict[str, Path], tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The streets that meet, then the junction; each street's name where it runs."""
    drawn: list[str] = []
    text = layers.Axes.text
    monkeypatch.setattr(
        layers.Axes, "text", lambda self, *a, **k: (drawn.append(a[2]), text(self, *a, **k))[1]
    )
    file = tmp_path / "a.svg"
    assert main(["inspect", str(networks["crossing"]), "--picture", str(file)]) == 0
    texts = _written(file)
    assert "Fabianinkatu / Yliopistonkatu" in texts
    assert "junction 4435014132, crossing.net.xml" in texts
    assert {"Fabianinkatu", "Yliopistonkatu"} <= set(drawn)
    assert capsys.readouterr().err == f"cavsumo: wrote {file}\n"


def test_letters_that_the_usual_font_lacks_are_written_in_another(
    networks: dict[str, Path], tmp_path: Path, capsys: Capture
) -> None:
    """Any font of the machine that has them."""
    manager = layers.font_manager
    usual = layers._letters(manager.findfont(manager.FontProperties()))
    others = sorted({e.fname for e in manager.fontManager.ttflist if layers.BOXES not in e.name})
    rare = next(
        chr(code)
        for file in others
        for code in sorted(layers._letters(file) - usual)
        if chr(code).isalpha() and code < 0xE000
    )
    file = tmp_path / "a.svg"
    net = _renamed(networks, tmp_path, f"{rare}{rare}")
    assert main(["inspect", str(net), "--picture", str(file)]) == 0
    assert any(f"{rare}{rare}" in text for text in _written(file))
    assert capsys.readouterr().err == f"cavsumo: wrote {file}\n"


def test_a_name_that_no_font_can_write_is_left_out_and_said(
    networks: dict[str, Path], tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The title then has the others; without any it is the junction."""
    monkeypatch.setattr(layers, "_letters", lambda file: frozenset(range(0x250)))
    layers.font_for.cache_clear()
    file = tmp_path / "a.svg"
    net = _renamed(networks, tmp_path, "\u82b1\u56ed\u8857")
    try:
        assert main(["inspect", str(net), "--picture", str(file)]) == 0
        err = capsys.readouterr().err
        assert "no font on this machine can write \u82b1\u56ed\u8857" in err
        assert "Yliopistonkatu" in _written(file)
        text = net.read_text(encoding="utf-8")
        net.write_text(text.replace("Yliopistonkatu", "\u5317\u8def"), encoding="utf-8")
        assert main(["inspect", str(net), "--picture", str(file)]) == 0
        assert "junction 4435014132" in _written(file)
    finally:
        layers.font_for.cache_clear()


def test_a_picture_that_takes_long_says_what_it_does(
    networks: dict[str, Path], tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On stderr, each step once; nothing before its time has come."""
    words = ["inspect", str(networks["crossing"]), "--picture", str(tmp_path / "a.svg")]
    written = f"cavsumo: wrote {words[-1]}"
    assert main(words) == 0
    assert capsys.readouterr().err == f"{written}\n"
    monkeypatch.setattr("cavsumo.cli.steps.AFTER_S", 0.0)
    assert main(words) == 0
    *lines, last = capsys.readouterr().err.splitlines()
    assert last == written
    assert [line.split()[1] for line in lines] == ["reading", "looking", "drawing"]
    assert all(line.startswith("cavsumo: ") and line.endswith(" ...") for line in lines)


@pytest.mark.parametrize(
    ("picture", "words"),
    [("a.jpeg", "ending in .png"), ("no/such/a.png", "no such folder")],
)
def test_a_picture_that_cannot_be_drawn_is_refused(
    networks: dict[str, Path],
    tmp_path: Path,
    capsys: Capture,
    picture: str,
    words: str,
) -> None:
    """Another ending, no folder: one sentence, nothing written."""
    assert main(["inspect", str(networks["crossing"]), "--picture", str(tmp_path / picture)]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n"), list(tmp_path.iterdir())) == ("", 1, [])
    assert words in err


# Networks that lack something


def test_without_pavements_it_says_what_to_do(
    networks: dict[str, Path], tmp_path: Path, capsys: Capture
) -> None:
    """A network for cars only, as many are, is shown; run refuses it with the same advice."""
    text = (
        networks["crossing"]
        .read_text(encoding="utf-8")
        .replace('allow="pedestrian"', 'allow="tram"')
    )
    net = tmp_path / "cars.net.xml"
    net.write_text(text, encoding="utf-8")
    found = _looked(capsys, str(net))
    assert found["facts"]["pavements"] == 0
    assert any("--sidewalks.guess --crossings.guess" in note for note in found["facts"]["notes"])
    assert found["junctions"]
    assert all(way["starting_areas"] == [] for j in found["junctions"] for way in j["ways"])
    assert main(["run", "--net", str(net), "--runs", "1", "-o", str(tmp_path / "r.csv")]) == 2
    assert "--sidewalks.guess" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("version", "noted"),
    [("1.20", False), ("1.9", False), ("2.0", True), ("0.13", True), ("1.44", True)],
)
def test_networks_of_another_sumo_are_noted(
    networks: dict[str, Path], tmp_path: Path, capsys: Capture, version: str, noted: bool
) -> None:
    """SUMO reads what it can of another format; the user should know."""
    net = tmp_path / "other.net.xml"
    text = networks["pedestrians"].read_text(encoding="utf-8")
    net.write_text(text.replace('version="1.20"', f'version="{version}"'), encoding="utf-8")
    notes = _looked(capsys, str(net))["facts"]["notes"]
    assert any("is of another SUMO" in note for note in notes) == noted


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "no such file"),
        ("", "not well-formed XML"),
        ("<osm/>", "begins with <net>, this file with <osm>"),
        ('<net version="2"/>', "cannot be read"),
        ('<net version="1.20"/>', "no lane on which a car may drive"),
    ],
)
def test_what_is_no_network_is_refused(
    tmp_path: Path, capsys: Capture, content: str | None, words: str
) -> None:
    """One sentence, exit status 2."""
    net = tmp_path / "bad.net.xml"
    if content is not None:
        net.write_text(content, encoding="utf-8")
    assert main(["inspect", str(net), "--json"]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert words in err


def test_an_unknown_junction_suggests_the_nearest(
    networks: dict[str, Path], capsys: Capture
) -> None:
    """The name that was probably meant is in the message; --top must be a number of junctions."""
    assert main(["inspect", str(networks["junction"]), "--junction", "2529156"]) == 2
    assert "did you mean '25291565'?" in capsys.readouterr().err
    assert main(["inspect", str(networks["junction"]), "--top", "0"]) == 2


@needs_netconvert
def test_a_town_is_inspected(grid: Path) -> None:
    """528 edges: read, ranked, three junctions looked at; run would choose the first."""
    network = read_network(grid)
    found = facts(network)
    here = ground(network, HALF_M)
    best = best_junctions(here, 3)
    assert (found.edges, found.junctions, len(best)) == (528, 144, 3)
    route, _ = best_route(network, here.roads, None, HALF_M)
    assert route.edges == best[0].ways[0].route.edges
