"""Networks out of OpenStreetMap extracts: what is made, what is said, what is refused."""

from __future__ import annotations

import gzip
import re
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest
from support import DATA

from cavsumo.cli import main
from cavsumo.errors import InputError
from cavsumo.network.facts import facts
from cavsumo.network.osm import netconvert as program
from cavsumo.network.osm.extract import find_roads, parse_box
from cavsumo.network.osm.items import read_items
from cavsumo.network.reader import read_network

CROSSROADS = DATA / "crossroads.osm"
WEST_HALF = "121.3970,31.1980,121.3989,31.2020"  # the junction without traffic lights

needs_netconvert = pytest.mark.usefixtures("netconvert")
Import = Callable[..., Path]
Capture = pytest.CaptureFixture[str]


@pytest.fixture
def imported(tmp_path: Path) -> Import:
    """Call with options and, if it is not the crossroads, an extract: the network's file."""

    def make(*options: str, source: Path = CROSSROADS, name: str = "place.net.xml") -> Path:
        output = tmp_path / name
        assert main(["import-osm", str(source), "-o", str(output), *options]) == 0
        return output

    return make


@pytest.fixture
def moved(tmp_path: Path) -> Callable[[float, float], Path]:
    """Call with degrees: the crossroads, moved to that latitude and longitude."""

    def move(lat: float, lon: float) -> Path:
        text = re.sub(
            r'lat="([\d.]+)" lon="([\d.]+)"',
            lambda m: f'lat="{float(m[1]) - 31.2 + lat:.4f}" lon="{float(m[2]) - 121.4 + lon:.4f}"',
            CROSSROADS.read_text(encoding="utf-8"),
        )
        file = tmp_path / "moved.osm"
        file.write_text(text, encoding="utf-8")
        return file

    return move


def _refused(capsys: Capture, folder: Path, *words: str) -> str:
    """What import-osm says to a command line that it refuses, having written nothing."""
    before = sorted(folder.rglob("*"))
    assert main(["import-osm", *words]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert sorted(folder.rglob("*")) == before
    return err


# What is made


@needs_netconvert
def test_a_network_comes_with_its_licence_its_command_and_its_log(
    imported: Import, capsys: Capture
) -> None:
    """The notice and the command stand at the top, without a name of a mapper or of a machine."""
    net = imported()
    text = net.read_text(encoding="utf-8")
    out, err = capsys.readouterr()
    head = text[: text.index("<net ")]
    assert "Contains map data (c) OpenStreetMap contributors" in head
    assert "cavsumo import-osm crossroads.osm\n" in head
    assert 'name="人民路"' in text
    log = net.with_name("place.net.log").read_text(encoding="utf-8")
    for file in (text, log):
        for word in ("mapper_one", "4321", "987654", str(Path.home()), "/tmp", "site-packages"):
            assert word not in file
    assert out.splitlines()[0].endswith("14 edges, 8 crossings, 1 traffic light, 343 x 223 m")
    assert f"cavsumo inspect {net}" in out
    assert f"cavsumo run --net {net}" in out
    lines = err.splitlines()
    assert len(lines) == 4
    assert f"netconvert gave {log.count('Warning: ')} warnings" in lines[0]
    assert lines[2].endswith("place.net.log")
    assert lines[3] == f"cavsumo: wrote {net.with_name('place.net.log')}"


@needs_netconvert
def test_the_same_import_gives_the_same_bytes(imported: Import) -> None:
    """Twice under other names, plain and packed."""
    first = imported("--zebra")
    assert imported("--zebra", name="again.net.xml").read_bytes() == first.read_bytes()
    packed = imported("--zebra", name="packed.net.xml.gz")
    assert gzip.decompress(packed.read_bytes()) == first.read_bytes()
    assert read_network(packed).net.getBoundary() == read_network(first).net.getBoundary()


@needs_netconvert
def test_packed_and_binary_extracts_give_the_same_network(imported: Import, tmp_path: Path) -> None:
    """.osm, .osm.xml.gz and .pbf of the same place differ in nothing but the name in the header."""
    osmium = pytest.importorskip("osmium")
    packed, binary = tmp_path / "crossroads.osm.xml.gz", tmp_path / "crossroads.osm.pbf"
    packed.write_bytes(gzip.compress(CROSSROADS.read_bytes()))
    with osmium.SimpleWriter(str(binary)) as writer:
        for item in osmium.FileProcessor(str(CROSSROADS)):
            writer.add(item)
    bodies = {
        source.name: re.sub(
            r"import-osm \S+", "", imported(source=source, name=f"{i}.net.xml").read_text()
        )
        for i, source in enumerate((CROSSROADS, packed, binary))
    }
    assert len(set(bodies.values())) == 1


@needs_netconvert
def test_a_box_keeps_whole_roads_that_touch_it(imported: Import) -> None:
    """Half of the crossroads: one junction, its four arms, one of them to beyond the box."""
    found = facts(read_network(imported("--bbox", WEST_HALF)))
    assert (found.junctions, found.crossings, found.traffic_lights) == (1, 4, 0)
    west = parse_box(WEST_HALF)
    roads = find_roads(CROSSROADS, west)
    assert roads.ways == {101, 103, 104}
    assert 4 in roads.nodes  # the far end of the main road


@needs_netconvert
def test_ways_may_stand_before_their_nodes(imported: Import, tmp_path: Path) -> None:
    """As Overpass writes them when asked for ways first: the same network."""
    text = CROSSROADS.read_text(encoding="utf-8")
    head, rest = text[: text.index("  <node")], text[text.index("  <node") :]
    nodes, ways = rest[: rest.index("  <way")], rest[rest.index("  <way") :]
    turned = tmp_path / "crossroads.osm"
    turned.write_text(head + ways.replace("</osm>", "") + nodes + "</osm>", encoding="utf-8")
    first = imported("--bbox", WEST_HALF)
    again = imported("--bbox", WEST_HALF, source=turned, name="turned.net.xml")
    assert again.read_bytes() == first.read_bytes()


@needs_netconvert
def test_zebras_give_priority_where_there_are_no_traffic_lights(imported: Import) -> None:
    """By default pedestrians yield; with --zebra they do not, and signals stay signals."""
    plain = facts(read_network(imported(name="plain.net.xml")))
    zebra = facts(read_network(imported("--zebra", name="zebra.net.xml")))
    assert (plain.crossings_with_signals, plain.crossings_without_priority) == (4, 4)
    assert (zebra.crossings_with_signals, zebra.crossings_with_priority) == (4, 4)


@needs_netconvert
def test_left_hand_traffic_is_made_when_asked_for_and_missed_when_not(
    imported: Import, moved: Callable[[float, float], Path], capsys: Capture
) -> None:
    """The same roads in Bristol: a warning with --right-hand, none and mirrored lanes with the
    other."""
    bristol = moved(51.46, -2.55)
    right = imported("--right-hand", source=bristol, name="right.net.xml")
    assert "keeps left: should this be imported with --left-hand?" in capsys.readouterr().err
    left = imported("--left-hand", "--zebra", source=bristol, name="left.net.xml")
    assert "--left-hand" not in capsys.readouterr().err
    for file, east in ((right, -1), (left, 1)):
        network = read_network(file)
        assert network.left_hand == (east == 1)
        edge = network.edge("102#0")  # southwards: the driver's left is east
        centre = network.junction("1").getCoord()[0]
        xs = [x for lane in edge.getLanes() for x, _ in lane.getShape()]
        assert all((x - centre) * east > 0 for x in xs)


@needs_netconvert
def test_the_side_is_that_of_the_place_where_that_is_certain(
    imported: Import, moved: Callable[[float, float], Path], capsys: Capture
) -> None:
    """London keeps left without a word; stderr, the output and the header of the network say so."""
    london = moved(51.51, -0.12)
    taken = imported(source=london)
    out, err = capsys.readouterr()
    assert "where traffic keeps left: imported for left-hand traffic; --right-hand" in err
    assert "left-hand traffic" in out
    assert read_network(taken).left_hand
    assert "import-osm moved.osm left-hand\n" in taken.read_text(encoding="utf-8")
    assert imported("--left-hand", source=london, name="b.net.xml").read_bytes() == (
        taken.read_bytes()
    )
    capsys.readouterr()
    assert not read_network(imported("--right-hand", source=london, name="c.net.xml")).left_hand


@needs_netconvert
@pytest.mark.parametrize(
    ("lat", "lon", "words"),
    [
        (48.85, 2.35, ""),  # Paris
        (
            50.95,
            1.85,
            "not certain: imported for right-hand traffic; --left-hand or",
        ),  # Calais
        (22.50, 114.13, "keeps left: should this be imported with --left-hand?"),  # Sheung Shui
    ],
)
def test_in_doubt_traffic_keeps_right_and_that_is_said(
    imported: Import,
    moved: Callable[[float, float], Path],
    capsys: Capture,
    lat: float,
    lon: float,
    words: str,
) -> None:
    """Far from any country that keeps left nothing is said; near one it is, on either side."""
    assert not read_network(imported(source=moved(lat, lon))).left_hand
    err = capsys.readouterr().err
    assert words in err
    assert ("hand" in err) == bool(words)


@needs_netconvert
def test_a_network_that_differs_is_replaced_only_when_told(
    imported: Import, tmp_path: Path, capsys: Capture
) -> None:
    """What may have been edited by hand is not lost; the same network again is no harm."""
    net = imported()
    imported()
    whole = net.read_bytes()
    net.write_bytes(whole.replace(b"13.89", b"8.33"))
    words = [str(CROSSROADS), "-o", str(net)]
    capsys.readouterr()
    assert "replace it with --overwrite" in _refused(capsys, tmp_path, *words)
    assert net.read_bytes() != whole
    imported("--overwrite")
    assert net.read_bytes() == whole


def test_pedestrian_signals_are_an_option_of_netconvert() -> None:
    """--keep-pedestrian-signals leaves out what discards them."""
    from cavsumo.cli.commands.import_osm import ImportOptions, _options

    for keep in (False, True):
        order = ImportOptions(CROSSROADS, Path("x.net.xml"), None, False, keep, False, False, 60.0)
        assert ("tls.discard-simple" in _options(order, None)) != keep


# What is refused

TRUNCATED = CROSSROADS.read_bytes()[:900]
NO_ROADS = b'<osm version="0.6"><node id="1" lat="1" lon="1"/></osm>'
FOOTWAY = CROSSROADS.read_bytes().replace(b"primary", b"footway").replace(b"residential", b"path")


@needs_netconvert
@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.osm", b"", "not well-formed XML"),
        ("a.osm", b"hello", "not well-formed XML"),
        ("a.osm", TRUNCATED, "not well-formed XML"),
        ("a.osm.gz", gzip.compress(CROSSROADS.read_bytes())[:300], "not well-formed XML"),
        ("a.osm", b"<html><body/></html>", "begins with <osm>, this file with <html>"),
        ("a.osm", NO_ROADS, "holds no roads"),
        (
            "a.osm",
            NO_ROADS.replace(b'lat="1"', b'lat="north"'),
            "<node id=1> has lat='north', expected degrees",
        ),
        ("a.osm", NO_ROADS.replace(b"</osm>", b"<remark>timeout</remark></osm>"), "incomplete"),
        ("a.osm", FOOTWAY, "no road that cars may use"),
        ("a.pbf", b"hello", "not a .pbf extract"),
    ],
)
def test_what_is_no_extract_is_refused(
    tmp_path: Path, capsys: Capture, name: str, content: bytes, words: str
) -> None:
    """Nothing, text, half a file, other XML, no roads: one sentence, nothing written."""
    if name.endswith(".pbf"):
        pytest.importorskip("osmium")
    file = tmp_path / name
    file.write_bytes(content)
    said = _refused(capsys, tmp_path, str(file), "-o", str(tmp_path / "n.net.xml"))
    assert words in said


@needs_netconvert
@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["missing.osm"], "no such file"),
        (["."], "is a folder"),
        (
            [str(CROSSROADS), "--bbox", "-3,50,-2,51"],
            "no road touches the box -3,50,-2,51; the data",
        ),
        ([str(CROSSROADS), "--bbox", "31.1,121.3,31.3,121.5"], "expected west < east"),
        ([str(CROSSROADS), "--bbox", "1,2,3"], "expected four numbers"),
        ([str(CROSSROADS), "--bbox", "3,1,2,4"], "expected west < east"),
        ([str(CROSSROADS), "--bbox", "nan,1,2,4"], "expected west < east"),
        ([str(CROSSROADS), "-o", "no/such/n.net.xml"], "no such folder"),
        ([str(CROSSROADS), "-o", "n.xml"], "ends in .net.xml"),
        ([str(CROSSROADS), "--time-limit", "0.001"], "was stopped after 0.001 s"),
    ],
)
def test_a_command_that_cannot_be_followed_is_refused(
    tmp_path: Path,
    capsys: Capture,
    monkeypatch: pytest.MonkeyPatch,
    options: list[str],
    words: str,
) -> None:
    """Files and folders that are not there, boxes off the data: one sentence, nothing written."""
    monkeypatch.chdir(tmp_path)
    output = [] if "-o" in options else ["-o", "n.net.xml"]
    assert words in _refused(capsys, tmp_path, *options, *output)


def test_swapped_coordinates_are_recognised(moved: Callable[[float, float], Path]) -> None:
    """Latitude first: the box lies elsewhere, and the message says why."""
    with pytest.raises(InputError, match="are latitude and longitude swapped"):
        find_roads(moved(51.46, -2.55), (51.459, -2.551, 51.461, -2.549))


@needs_netconvert
def test_a_crash_of_netconvert_is_one_sentence(tmp_path: Path) -> None:
    """netconvert 1.28 dies of a crossing beside the roads when told to import crossings."""
    (tmp_path / "e.osm").write_text(
        '<osm version="0.6"><node id="1" lat="1" lon="1"/><node id="2" lat="1.001" lon="1"/>'
        '<node id="3" lat="1" lon="1.001"><tag k="highway" v="crossing"/></node>'
        '<way id="1"><nd ref="1"/><nd ref="2"/><tag k="highway" v="residential"/></way></osm>'
    )
    options = ["osm-files=e.osm", *program.OSM_OPTIONS, "osm.crossings", "output-file=n.net.xml"]
    typemaps = program.typemap_option(str(program.sumo_home()))
    with pytest.raises(InputError, match=r"netconvert [\d.]+ crashed \(SIGSEGV\)"):
        program.netconvert([*options, typemaps], tmp_path)


@pytest.mark.parametrize("status", [-11, 139, 245])
def test_a_crash_is_known_through_wrappers(monkeypatch: pytest.MonkeyPatch, status: int) -> None:
    """A shell makes 139 of a segmentation fault, Python's sys.exit 245."""
    monkeypatch.setattr(program, "netconvert_version", lambda: "1")
    assert "crashed (SIGSEGV)" in program._failure(status, [])


def test_missing_packages_are_named_with_the_extra(
    tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without osmium no .pbf, without eclipse-sumo nothing: what to install is said."""
    monkeypatch.setitem(sys.modules, "osmium", None)
    (tmp_path / "a.pbf").write_bytes(b"")
    with pytest.raises(InputError, match=r"needs the package osmium: pip install 'cavsumo\[osm\]'"):
        next(read_items(tmp_path / "a.pbf"))
    monkeypatch.setattr(program, "find_spec", lambda name: None)
    said = _refused(capsys, tmp_path, str(CROSSROADS), "-o", str(tmp_path / "n.net.xml"))
    assert "package eclipse-sumo: pip install 'cavsumo[osm]'" in said


# What is said


def test_warnings_are_counted_by_kind() -> None:
    """Ids and numbers do not make a kind; three lines, however many there are."""
    lines = [f"Warning: Edge '{i}' is {i}.5 m long." for i in range(7)]
    lines += ["Warning: Other.", "Success."]
    assert program.warning_kinds(lines) == Counter({"Edge ... is ... m long.": 7, "Other.": 1})
    said = program.warning_summary(lines, Path("n.net.log"))
    assert len(said) == 3
    assert "8 warnings of 2 kinds" in said[0]
    assert program.warning_summary([], Path("n.net.log")) == []
