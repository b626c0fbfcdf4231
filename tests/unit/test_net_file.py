"""Damaged networks: refused by line and element, in words that speak of the file."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cavsumo.errors import NetworkError
from cavsumo.network.facts import facts
from cavsumo.network.net_format import LINE, NUMBER
from cavsumo.network.reader import read_network

JUNCTION_EDGE = (
    '<edge id=":w_0" function="internal"><lane id=":w_0_0" index="0" speed="5" length="1" '
    'shape="0,0 1,0"/></edge>\n    <edge id="eastbound"'
)
CROSSING = JUNCTION_EDGE.replace("internal", "crossing").replace(":w_0", ":west_c0")
IN_CIRCLE = (
    '<edge id=":west_0" function="internal"><lane id=":west_0_0" index="0" speed="5" length="1" '
    'shape="0,0 1,0"/></edge>\n    <edge id="eastbound"'
)


def connection(rest: str) -> str:
    """A connection at the end of the network."""
    return f'<connection dir="s" state="M" {rest}/></net>'


def replaced(networks: dict[str, Path], folder: Path, old: str, new: str) -> Path:
    """The straight road with something else in the place of a text, once."""
    file = folder / "bad.net.xml"
    text = networks["pedestrians"].read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    return file


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (' version="1.20"', "", "line 14: <net> has no version, expected a version such as 1.20"),
        ('version="1.20"', 'version="2"', "<net> has version='2', expected a version such as 1.20"),
        ('shape="0.000,-5.150 99.000,-5.150"', 'shape="0,0"', "line 19: <lane> has shape='0,0', "),
        ("99.000,-5.150", "nan,-5.150", "expected two points x,y or more, with blanks between"),
        ("99.000,-5.150", "1e999,-5.150", "expected two points x,y or more"),
        ("99.000,-5.150", "99.000,-5.150,1,2", "expected two points x,y or more"),
        ('speed="13.890"', 'speed="fast"', "<lane> has speed='fast', expected a number of at"),
        ('length="99.000"', 'length="-1"', "<lane> has length='-1', expected a number of at least"),
        ('width="3.000"', 'width=""', "<lane> has width='', expected a number"),
        ("<edge ", '<edge function="x" ', "expected one of internal, crossing, walkingarea, conn"),
        ('priority="-1"', 'priority="!"', "<edge> has priority='!', expected a whole number"),
        ('edge id="eastbound" ', "edge ", "<edge> has no id, expected a name"),
        ('from="west"', 'from="wst"', "<edge id='eastbound'>: there is no junction 'wst'"),
        (' to="east"', "", "<edge id='eastbound'>: there is no junction ''"),
        ('id="westbound"', 'id="eastbound"', "<edge id='eastbound'> is there twice"),
        ('junction id="west"', 'junction id="east"', "<junction id='east'> is there twice"),
        ('junction id="west"', 'junction id=""', "<junction> has id='', expected a name"),
        (' y="0.000"', "", "<junction> has no y, expected a number"),
        (' intLanes=""', "", "<junction> has no intLanes"),
        (' origBoundary="0.000,0.000,99.000,0.000"', "", "<location> has no origBoundary"),
        ('convBoundary="0.000,', 'convBoundary="', "expected 4 numbers with commas between"),
        (
            "<location",
            '<edge id="a" from="west" to="east"/><location',
            "<edge id='a'> has no <lane>",
        ),
        ("<location", '<lane speed="1" length="1" shape="0,0 1,1"/><location', "outside of <edge>"),
        ("<location", '<phase duration="1" state="G"/><location', "stands outside of <tlLogic>"),
        ("<location", '<request index="0" foes="0" response="0"/><location', "of <junction>"),
        ('<edge id="eastbound"', JUNCTION_EDGE, "<edge id=':w_0'>: there is no junction 'w'"),
        ('<edge id="eastbound"', CROSSING, "<edge id=':west_c0'> has no crossingEdges"),
    ],
)
def test_a_damaged_element_is_named(
    networks: dict[str, Path], tmp_path: Path, old: str, new: str, words: str
) -> None:
    """With its line, the attribute, what it is, and what was expected."""
    file = replaced(networks, tmp_path, old, new)
    with pytest.raises(NetworkError) as error:
        read_network(file, foes=True)
    assert words in str(error.value)
    assert re.match(r"network '.*bad\.net\.xml': cannot be read: line \d+: ", str(error.value))


ENDS = 'from="eastbound" to="westbound" fromLane="1" toLane="1"'


@pytest.mark.parametrize(
    ("rest", "words"),
    [
        (ENDS.replace("eastbound", "eastbond"), "there is no lane '1' of edge 'eastbond'"),
        (ENDS.replace('"1"', '"2"'), "there is no lane '2' of edge 'eastbound'"),
        (ENDS.replace('"1"', '"x"'), "<connection> has fromLane='x', expected a whole number of"),
        (f'{ENDS} via=":a_0_0"', "there is no lane '0' of edge ':a_0'"),
        (f'{ENDS} via="a"', "there is no lane 'a' of edge ''"),
        (f'{ENDS} tl="light"', "has a tl and no linkIndex of at least 0"),
        (f'{ENDS} tl="light" linkIndex="-1"', "has a tl and no linkIndex of at least 0"),
        (f'{ENDS} tl="light" linkIndex="2"', "linkIndex=2, and light 'light' has a state of 2 let"),
    ],
)
def test_a_connection_of_what_is_not_there_is_named(
    networks: dict[str, Path], tmp_path: Path, rest: str, words: str
) -> None:
    """Lanes by their numbers, lanes inside junctions, traffic lights."""
    light = '<tlLogic id="light" type="static" programID="0" offset="0">'
    light += '<phase duration="9" state="Gr"/></tlLogic>'
    file = replaced(networks, tmp_path, "</net>", light + connection(rest))
    with pytest.raises(NetworkError) as error:
        read_network(file)
    assert words in str(error.value)


def test_a_way_through_a_junction_has_an_end(networks: dict[str, Path], tmp_path: Path) -> None:
    """Who followed one that leads in a circle would never come out."""
    file = replaced(networks, tmp_path, '<edge id="eastbound"', IN_CIRCLE)
    way = 'from=":west_0" to="eastbound" fromLane="0" toLane="1" via=":west_0_0"'
    text = file.read_text(encoding="utf-8").replace("</net>", connection(way))
    file.write_text(text, encoding="utf-8")
    with pytest.raises(NetworkError, match="via lane ':west_0_0' lead in a circle"):
        read_network(file)


@pytest.mark.parametrize("name", ["foo-bar", "utf-7", "shift_jis", "rot13", "idna", "x" * 300])
def test_an_encoding_that_is_not_read_is_refused(
    networks: dict[str, Path], tmp_path: Path, name: str
) -> None:
    """Whatever Python makes of it."""
    file = replaced(networks, tmp_path, 'encoding="UTF-8"', f'encoding="{name}"')
    with pytest.raises(NetworkError, match="not well-formed XML: "):
        read_network(file)


def test_what_no_reader_needs_may_stand_anywhere(networks: dict[str, Path], tmp_path: Path) -> None:
    """Parameters of the network itself, elements of others, a network without a location."""
    more = '<param key="a" value="b"/><unknown/><junction id=":west_0_0" type="internal"/></net>'
    file = replaced(networks, tmp_path, "</net>", more)
    text = re.sub("<location.*/>", "", file.read_text(encoding="utf-8"))
    file.write_text(text, encoding="utf-8")
    found = facts(read_network(file, foes=True))
    assert (found.edges, found.width_m, found.height_m) == (2, 99.0, 0.0)


def test_every_network_of_ours_is_read(networks: dict[str, Path]) -> None:
    """With its crossings, traffic lights and rules of priority."""
    for file in networks.values():
        assert read_network(file, foes=True).edges


@pytest.mark.parametrize(
    ("text", "number", "line"),
    [
        ("-1.50", True, False),
        ("+2.", True, False),
        (" .5 ", True, False),
        ("1e3", True, False),
        ("1e9", False, False),
        ("100000000", True, False),
        ("100000001", False, False),
        ("1.2.3", False, False),
        ("\u0661", False, False),
        ("1,2 3,4", False, True),
        ("1,2,0  3e1,.4\t5,6", False, True),
        ("1,2 3", False, False),
        ("1,2", False, False),
        ("1,2 3,4,5,6", False, False),
        ("1,2 3,100000001", False, False),
        (",".join(["1" * 50] * 2), False, False),
    ],
)
def test_numbers_and_lines_by_hand(text: str, number: bool, line: bool) -> None:
    """Written plainly or not, within bounds."""
    assert (NUMBER.fits(text), LINE.fits(text)) == (number, line)
