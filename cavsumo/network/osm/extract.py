"""OpenStreetMap extracts: their roads, read as XML or .pbf, written without mappers' names.

Users' names and ids, changesets and dates are never copied: an item has its id, its place, its tags
and its parts.
"""

from __future__ import annotations

import bz2
import gzip
import re
import zlib
from collections import Counter
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, TextIO
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

from cavsumo.errors import InputError, plain, shown
from cavsumo.network.osm.xml_stream import Element, read_elements

Box = tuple[float, float, float, float]  # west, south, east, north [degrees]
DIGITS = 7  # decimals of a coordinate in OpenStreetMap
EXTRA = "pip install 'cavsumo[osm]'"
OPENERS = {b"\x1f\x8b": gzip.open, b"BZ": bz2.open}
# Tracks are not driven on, but they divide the roads that they cross or lie in.
TRACKS = frozenset({"highway", "railway"})
SIDES, COUNTRIES = ("left", "right"), ("addr:country", "is_in:country_code")
# Tags whose values begin with the code of the country that made the rule.
RULES = ("traffic_sign", "source:maxspeed", "maxspeed:type", "zone:traffic", "zone:maxspeed")
NUMBER = re.compile(r"-?[0-9]{1,18}")  # of an item: OpenStreetMap has 64 bits
COORDINATE = re.compile(r"[-+]?[0-9]{1,3}(\.[0-9]{1,30})?([eE][-+]?[0-9]{1,2})?")
KINDS = {"n": "node", "w": "way", "r": "relation"}


@dataclass(frozen=True, slots=True)
class Item:
    """A node, way or relation.

    Attributes:
        kind: one of these words.
        id: its number.
        tags: its tags.
        lat, lon: the place of a node, as written [degrees].
        refs: the nodes of a way.
        members: of a relation: kind, id and role.
    """

    kind: str
    id: int
    tags: Mapping[str, str]
    lat: str = ""
    lon: str = ""
    refs: tuple[int, ...] = ()
    members: tuple[tuple[str, int, str], ...] = ()


@dataclass
class RoadExtract:
    """The items of an extract that belong to its roads, and the hints to its location.

    Attributes:
        nodes, ways: ids of the items to keep.
        bounds: west, south, east, north of all nodes [degrees]; None without any.
        hints: number of occurrences of each tag that indicates the country or the side of traffic.
    """

    nodes: set[int] = field(default_factory=set)
    ways: set[int] = field(default_factory=set)
    bounds: Box | None = None
    hints: Counter[tuple[str, str]] = field(default_factory=Counter)


def parse_box(text: str) -> Box:
    """The box W,S,E,N of a command line."""
    try:
        west, south, east, north = (float(word) for word in text.split(","))
    except ValueError:
        raise InputError(
            f"--bbox: expected four numbers W,S,E,N in degrees, got {text!r}"
        ) from None
    if not (-180 <= west < east <= 180 and -90 <= south < north <= 90):
        raise InputError(
            f"--bbox {text}: expected west < east and south < north, in degrees (longitude, "
            "latitude, longitude, latitude)"
        )
    return west, south, east, north


def find_roads(file: Path, box: Box | None) -> RoadExtract:
    """The roads of an extract, whole, that touch the box; raises InputError when there are none.

    Read twice, because nodes may stand before the ways that use them or behind (Overpass), and
    only those of roads and tracks are kept.
    """
    found = RoadExtract()
    tracks = _tracks(file, found)
    if not any(track.is_road for track in tracks):
        raise InputError(f"extract {str(file)!r}: holds no roads (no way has the tag highway)")
    inside = _nodes_within(file, {ref for track in tracks for ref in track.refs}, box)
    near = False
    for track in tracks:
        if not inside.isdisjoint(track.refs):
            found.ways.add(track.id)
            found.nodes.update(track.refs)
            near = near or track.is_road
    if not near:
        raise InputError(f"extract {str(file)!r}: {_off_the_data(box, found.bounds)}")
    return found


class _Track(NamedTuple):
    """A road or track: its way's id, its nodes, and whether it is a road."""

    id: int
    refs: tuple[int, ...]
    is_road: bool


def _tracks(file: Path, found: RoadExtract) -> list[_Track]:
    """The roads and tracks of an extract; hints to its location are added to ``found``."""
    tracks = []
    for item in read_items(file):
        _note_hints(item, found.hints)
        if item.kind == "node":
            found.bounds = _widened(found.bounds, float(item.lon), float(item.lat))
        elif item.kind == "way" and not TRACKS.isdisjoint(item.tags):
            tracks.append(_Track(item.id, item.refs, "highway" in item.tags))
    return tracks


def _nodes_within(file: Path, wanted: Container[int], box: Box | None) -> set[int]:
    """The required nodes that exist and lie in the box, if there is one."""
    return {
        item.id
        for item in read_items(file)
        if item.kind == "node"
        and item.id in wanted
        and _within((float(item.lon), float(item.lat)), box)
    }


def _widened(bounds: Box | None, lon: float, lat: float) -> Box:
    """The bounds with one more place in them."""
    west, south, east, north = bounds or (lon, lat, lon, lat)
    return min(west, lon), min(south, lat), max(east, lon), max(north, lat)


def _within(place: tuple[float, float], box: Box | None) -> bool:
    """Whether a place lies in the box, if there is one."""
    return box is None or (box[0] <= place[0] <= box[2] and box[1] <= place[1] <= box[3])


def write_roads(file: Path, roads: RoadExtract, target: TextIO) -> None:
    """Write the roads found in an extract as OSM XML, with whole turn restrictions.

    Nodes come first, wherever they stand in the extract: netconvert finds no others.
    """
    behind: list[Item] = []
    target.write(
        '<?xml version="1.0" encoding="UTF-8"?>\n<osm version="0.6" generator="cavsumo">\n'
    )
    for item in read_items(file):
        if _is_kept(item, roads):
            if item.kind == "node":
                target.writelines(_xml(item))
            else:
                behind.append(item)
    for item in behind:
        target.writelines(_xml(item))
    target.write("</osm>\n")


def check_extract(file: Path) -> None:
    """Raise InputError unless the file is there."""
    if not file.is_file():
        what = "is a folder" if file.is_dir() else "no such file"
        raise InputError(f"extract {str(file)!r}: {what}")


def read_items(file: Path) -> Iterator[Item]:
    """The items of an extract in the order of the file; raises InputError in one sentence."""
    check_extract(file)
    if file.suffix == ".pbf":
        yield from _pbf_items(file)
        return
    try:
        yield from _xml_items(file)
    except ElementTree.ParseError as error:
        raise InputError(f"extract {str(file)!r}: not well-formed XML: {error}") from error
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise InputError(
            f"extract {str(file)!r}: not well-formed XML: a damaged archive"
        ) from error
    except OSError as error:
        why = error.strerror or "a damaged archive"
        raise InputError(f"extract {str(file)!r}: cannot be read: {why}") from error


def _xml_items(file: Path) -> Iterator[Item]:
    """The items of an .osm, packed or not."""
    with file.open("rb") as raw:
        opener: Any = OPENERS.get(raw.read(2), open)
    with opener(file, "rb") as stream:
        for element in read_elements(stream, str(file)):
            said = element.attrib
            if said.get("action") != "delete" and said.get("visible") != "false":
                try:
                    item = _from_xml(element)
                except ValueError as error:
                    raise InputError(f"extract {str(file)!r}: {error}") from error
                yield item


def _from_xml(element: Element) -> Item:
    """An item from its element; ValueError says which attribute is none."""
    kind, parts = element.tag, element.parts
    number = _number(f"<{kind}>", element.attrib, "id")
    name = f"<{kind} id={number}>"
    tags = {_text(name, tag, "k"): _text(name, tag, "v") for tag in parts["tag"]}
    if kind == "node":
        lat, lon = (_degrees(name, element.attrib, *key) for key in (("lat", 90), ("lon", 180)))
        return Item(kind, number, tags, lat, lon)
    if kind == "way":
        refs = tuple(_number(f"<nd> of {name}", nd, "ref") for nd in parts["nd"])
        return Item(kind, number, tags, refs=refs)
    member = f"<member> of {name}"
    members = tuple(
        (_text(member, m, "type"), _number(member, m, "ref"), m.get("role", ""))
        for m in parts["member"]
    )
    return Item(kind, number, tags, members=members)


def _text(name: str, attributes: Mapping[str, str], key: str) -> str:
    """An attribute; ValueError when there is none."""
    if key not in attributes:
        raise ValueError(f"{name} has no {key}")
    return attributes[key]


def _number(name: str, attributes: Mapping[str, str], key: str) -> int:
    """An attribute as the number of an item; ValueError when it is none."""
    text = _text(name, attributes, key)
    if not NUMBER.fullmatch(text):
        raise ValueError(f"{name} has {key}={shown(text)}, expected a whole number")
    return int(text)


def _degrees(name: str, attributes: Mapping[str, str], key: str, most: int) -> str:
    """An attribute that is a coordinate, as written; ValueError when it is none."""
    text = _text(name, attributes, key)
    if not (COORDINATE.fullmatch(text) and abs(float(text)) <= most):
        raise ValueError(f"{name} has {key}={shown(text)}, expected degrees from -{most} to {most}")
    return text


def _pbf_items(file: Path) -> Iterator[Item]:
    """The items of a .pbf."""
    try:
        import osmium
    except ImportError:
        raise InputError(
            f"extract {str(file)!r}: reading .pbf needs the package osmium: {EXTRA}"
        ) from None
    try:
        for item in osmium.FileProcessor(str(file)):
            yield _from_osmium(item)
    except (RuntimeError, OSError) as error:
        raise InputError(f"extract {str(file)!r}: not a .pbf extract: {plain(error)}") from error


def _from_osmium(item: Any) -> Item:
    """An item from osmium's, whose data is gone when the next one is read."""
    tags = {tag.k: tag.v for tag in item.tags}
    if item.is_node():
        lat, lon = (f"{x:.{DIGITS}f}" for x in (item.location.lat, item.location.lon))
        return Item("node", item.id, tags, lat, lon)
    if item.is_way():
        return Item("way", item.id, tags, refs=tuple(node.ref for node in item.nodes))
    members = tuple((KINDS[m.type], m.ref, m.role) for m in item.members)
    return Item("relation", item.id, tags, members=members)


def _is_kept(item: Item, roads: RoadExtract) -> bool:
    """Whether an item belongs to the roads: one of them, its nodes, a whole turn restriction."""
    if item.kind == "node":
        return item.id in roads.nodes
    if item.kind == "way":
        return item.id in roads.ways
    kept = {"node": roads.nodes, "way": roads.ways}
    whole = bool(item.members) and all(ref in kept.get(kind, ()) for kind, ref, _ in item.members)
    return whole and item.tags.get("type") == "restriction"


def _xml(item: Item) -> Iterator[str]:
    """The lines of an item."""
    place = f' lat="{item.lat}" lon="{item.lon}"' if item.kind == "node" else ""
    yield f'<{item.kind} id="{item.id}"{place}>\n'
    for ref in item.refs:
        yield f'<nd ref="{ref}"/>\n'
    for kind, ref, role in item.members:
        yield f'<member type="{kind}" ref="{ref}" role={quoteattr(role)}/>\n'
    for key, value in item.tags.items():
        yield f"<tag k={quoteattr(key)} v={quoteattr(value)}/>\n"
    yield f"</{item.kind}>\n"


def _note_hints(item: Item, hints: Counter[tuple[str, str]]) -> None:
    """Count the tags that tell the side of the road or the country."""
    for key, value in item.tags.items():
        if (key == "driving_side" and value in SIDES) or (key in COUNTRIES and _is_code(value)):
            hints[key, value] += 1
        elif key in RULES and value[2:3] == ":" and _is_code(value[:2]):  # GB:nsl, DE:274.1
            hints[key, value[:2]] += 1


def _is_code(text: str) -> bool:
    """Whether a text may be the code of a country."""
    return len(text) == 2 and text.isascii() and text.isalpha()


def _off_the_data(box: Box | None, bounds: Box | None) -> str:
    """The reason why no road was found."""
    if box is None or bounds is None:
        return "none of its roads has a node in it: the extract is incomplete"
    reach = ",".join(f"{x:.4f}" for x in bounds)
    turned = (box[1], box[0], box[3], box[2])
    swapped = all(
        low <= x <= high
        for low, x, high in zip(bounds[:2] * 2, turned, bounds[2:] * 2, strict=True)
    )
    hint = "; are latitude and longitude swapped?" if swapped else ""
    asked = ",".join(f"{x:g}" for x in box)
    return f"no road touches the box {asked}; the data is within {reach}{hint}"
