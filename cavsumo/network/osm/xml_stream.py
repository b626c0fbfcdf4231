"""OSM XML as a stream: one item at a time, all other content discarded while it is read.

No tree is built, so memory holds one item, for a file of any size. Quantities that could still grow
without bound (nesting, names, the length of a tag or an item) have limits far above those of
OpenStreetMap's own interface (2,000 nodes per way, 32,000 members per relation).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import IO
from xml.etree import ElementTree

from cavsumo.errors import InputError

ITEMS = ("node", "way", "relation")
PARTS = ("tag", "nd", "member")
CHUNK = 1 << 16  # bytes that are parsed at a time
DEPTH = 64  # of elements in each other
NAMES = 10_000  # of elements and attributes, which the parser keeps
PARTS_LIMIT = 100_000  # of one item
MARKUP_LIMIT = 1 << 23  # bytes of one tag or comment
REMARK = 200  # characters of a remark that are kept


@dataclass(slots=True)
class Element:
    """A node, way or relation as it is written: its attributes and those of its parts.

    Attributes:
        tag: node, way or relation.
        attrib: its attributes.
        parts: the attributes of its tags, nodes and members, by the names of these elements.
    """

    tag: str
    attrib: dict[str, str]
    parts: dict[str, list[dict[str, str]]] = field(
        default_factory=lambda: {name: [] for name in PARTS}
    )


def read_elements(stream: IO[bytes], name: str) -> Iterator[Element]:
    """The items of OSM XML in the order of the file.

    ``name`` is that of the file, for messages. Raises InputError for XML that is no OSM, is
    marked as incomplete or exceeds a limit; ElementTree.ParseError for invalid XML.
    """
    target = _Target(name)
    parser = ElementTree.XMLParser(target=target)
    unseen = 0  # bytes since the last event of the parser
    while chunk := stream.read(CHUNK):
        before = target.events
        _feed(parser, chunk, name)
        unseen = 0 if target.events != before else unseen + len(chunk)
        if unseen > MARKUP_LIMIT:
            raise InputError(f"extract {name!r}: a tag or comment of more than {unseen} bytes")
        yield from target.take()
    parser.close()
    yield from target.take()


def _feed(parser: ElementTree.XMLParser, chunk: bytes, name: str) -> None:
    """Parse on; an encoding that the parser does not know is refused."""
    try:
        parser.feed(chunk)
    except (LookupError, ValueError) as error:
        raise InputError(
            f"extract {name!r}: not well-formed XML: its encoding cannot be read, expected UTF-8"
        ) from error


class _Target:
    """The target of the parser: keeps the current item and the completed items.

    Attributes:
        events: how often it was called.
    """

    def __init__(self, name: str) -> None:
        self.events = 0
        self._name, self._names, self._depth = name, set[str](), 0
        self._item: Element | None = None
        self._whole: list[Element] = []
        self._remark: str | None = None

    def take(self) -> list[Element]:
        """The items completed since the last call."""
        whole, self._whole = self._whole, []
        return whole

    def start(self, tag: str, attrib: dict[str, str]) -> None:
        """An element begins."""
        self.events += 1
        self._depth += 1
        self._check(tag, attrib)
        if self._depth == 1 and tag != "osm":
            raise self._refused(
                f"an OpenStreetMap extract begins with <osm>, this file with <{tag[:40]}>"
            )
        if self._item is None:
            if tag in ITEMS:
                self._item, self._inside = Element(tag, attrib), self._depth
            elif tag == "remark":
                self._remark = ""
        elif tag in PARTS and self._depth == self._inside + 1:
            parts = self._item.parts[tag]
            parts.append(attrib)
            if len(parts) > PARTS_LIMIT:
                raise self._refused(f"a {self._item.tag} with more than {PARTS_LIMIT} <{tag}>")

    def end(self, tag: str) -> None:
        """An element ends."""
        self.events += 1
        if self._item is not None and self._depth == self._inside:
            self._whole.append(self._item)
            self._item = None
        elif self._remark is not None and tag == "remark":
            raise self._refused(f"is incomplete: {self._remark[:REMARK]}")
        self._depth -= 1

    def data(self, text: str) -> None:
        """Text between tags, of which only a remark matters."""
        self.events += 1
        if self._remark is not None and len(self._remark) < REMARK:
            self._remark += text

    def comment(self, text: str) -> None:
        """A comment, which is discarded."""
        self.events += 1

    def pi(self, name: str, text: str | None = None) -> None:
        """An instruction to other programs, which is discarded."""
        self.events += 1

    def close(self) -> None:
        """The file ends."""

    def _check(self, tag: str, attrib: dict[str, str]) -> None:
        """Refuse input that makes the parser itself grow."""
        self._names.add(tag)
        self._names.update(attrib)
        if len(self._names) > NAMES:
            raise self._refused(f"more than {NAMES} names of elements and attributes")
        if self._depth > DEPTH:
            raise self._refused(f"elements in each other, more than {DEPTH} deep")

    def _refused(self, why: str) -> InputError:
        """The error that gives the reason why the file is not an extract."""
        return InputError(f"extract {self._name!r}: {why}")
