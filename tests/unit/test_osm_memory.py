"""The memory that a reader of OpenStreetMap extracts needs: nothing of what it drops stays."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import pytest

from cavsumo.errors import InputError
from cavsumo.network.osm import xml_stream
from cavsumo.network.osm.extract import find_roads, write_roads

ROAD = (
    '<node id="1" lat="1" lon="1"/><node id="2" lat="1.001" lon="1"/><way id="1"><nd ref="1"/>'
    '<nd ref="2"/><tag k="highway" v="residential"/></way>'
)
MANY = 10_000
GROWING = {
    "elements of another sort": "<zz/>" * MANY,
    "those inside an item": f"<node id='9' lat='1' lon='1'>{'<zz/>' * MANY}</node>",
    "those of a remark's depth": f"<note>{'<comment>a</comment>' * MANY}</note>",
    "comments": "<!--a-->" * MANY,
    "nodes of no road": "".join(f"<node id='{i}' lat='1' lon='1'/>" for i in range(9, MANY)),
    "ways that are no roads": "".join(
        f"<way id='{i}'><nd ref='{i}'/></way>" for i in range(9, MANY // 2)
    ),
    "relations without members": "<relation id='1'><tag k='type' v='restriction'/></relation>"
    * (MANY // 2),
    "countries": "".join(
        f"<node id='9' lat='1' lon='1'><tag k='addr:country' v='{i}'/></node>"
        for i in range(MANY // 2)
    ),
}


@pytest.mark.parametrize("content", GROWING.values(), ids=list(GROWING))
def test_the_memory_of_an_import_does_not_grow_with_what_it_drops(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: str
) -> None:
    """What does not belong to the roads leaves no trace in memory, not even a number each.

    Read in small pieces: an item needs some hundred bytes while the piece that holds it is parsed.
    """
    monkeypatch.setattr(xml_stream, "CHUNK", 4096)
    file = tmp_path / "a.osm"
    file.write_text(f'<osm version="0.6">{ROAD}{content}</osm>', encoding="utf-8")
    find_roads(file, None)  # what is imported and cached on the way
    tracemalloc.start()
    try:
        roads = find_roads(file, None)
        with (tmp_path / "roads.osm").open("w", encoding="utf-8") as stream:
            write_roads(file, roads, stream)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert (roads.ways, roads.nodes) == ({1}, {1, 2})
    assert peak < 400_000, f"{peak} bytes"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("<a>" * 100 + "</a>" * 100, "elements in each other, more than 64 deep"),
        ("".join(f"<z{i}/>" for i in range(10_100)), "more than 10000 names of elements"),
        ("<a " + " ".join(f"z{i}=''" for i in range(10_100)) + "/>", "more than 10000 names"),
        ("<way id='7'>" + "<nd ref='1'/>" * 100_001 + "</way>", "a way with more than 100000 <nd>"),
        (f"<a b='{'x' * 9_000_000}'/>", "a tag or comment of more than"),
        (f"<!--{'x' * 9_000_000}-->", "a tag or comment of more than"),
    ],
    ids=["depth", "elements", "attributes", "parts", "tag", "comment"],
)
def test_what_would_make_the_parser_grow_is_refused(
    tmp_path: Path, content: str, words: str
) -> None:
    """In one sentence that names the file, and not too long."""
    file = tmp_path / "a.osm"
    file.write_text(f'<osm version="0.6">{ROAD}{content}</osm>', encoding="utf-8")
    with pytest.raises(InputError, match=words) as caught:
        find_roads(file, None)
    assert str(caught.value).startswith(f"extract {str(file)!r}: ")
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize("encoding", ["foo-bar", "utf-7", "shift_jis"])
def test_an_encoding_that_is_not_read_is_refused(tmp_path: Path, encoding: str) -> None:
    """The parser's words are quoted, of an extract and not of Python."""
    file = tmp_path / "a.osm"
    file.write_text(f'<?xml version="1.0" encoding="{encoding}"?><osm>{ROAD}</osm>')
    with pytest.raises(InputError, match="not well-formed XML") as caught:
        find_roads(file, None)
    assert "Error" not in str(caught.value)
