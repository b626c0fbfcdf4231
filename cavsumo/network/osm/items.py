"""The items of an OpenStreetMap file, read as XML or .pbf: nodes, ways and relations.

Users' names and ids, changesets and dates are never read: an item has its id, its place, its tags
and its parts.
"""

from __future__ import annotations

import bz2
import gzip
import re
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from cavsumo.errors import InputError, plain, shown
from cavsumo.network.osm.xml_stream import Element, read_elements

DIGITS = 7  # decimals of a coordinate in OpenStreetMap
EXTRA = "pip install 'cavsumo[osm]'"
OPENERS = {b"\x1f\x8b": gzip.open, b"BZ": bz2.open}
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
