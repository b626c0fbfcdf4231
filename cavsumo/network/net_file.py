"""A network file as a stream: every element is checked before sumolib's reader gets it.

sumolib does not check a file; damage becomes an error of Python there or where the network is used.
So all used parts of a network (attributes, numbers, shapes, references from element to element) are
checked here, where the line is known.
"""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple
from xml.sax import SAXException, SAXParseException
from xml.sax import parse as parse_xml
from xml.sax.handler import ContentHandler

import sumolib

from cavsumo.errors import NetworkError, shown
from cavsumo.network.net_format import ELEMENTS, INDEX, INSIDE, LEFT_OUT, PARENTS
from cavsumo.network.network_file import opened

HOLDERS = ("lane", "edge", "junction", "connection", "tlLogic")  # whose <param> sumolib takes


class Read(NamedTuple):
    """A network that was read: sumolib's, and the attributes of its <net>."""

    net: Any
    root: dict[str, str]


def read_net(file: Path, *, foes: bool) -> Read:
    """Read a network file, packed or not; raises NetworkError in one sentence.

    ``foes``: with the tables of right of way.
    """
    name = f"network {str(file)!r}"
    reader = _Reader(name, foes)
    try:
        with opened(file) as stream:
            parse_xml(stream, reader)
    except SAXParseException as error:
        place = f"line {error.getLineNumber()}: {error.getMessage()}"
        raise NetworkError(f"{name}: not well-formed XML: {place}") from error
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise NetworkError(f"{name}: not well-formed XML: a damaged .gz") from error
    except OSError as error:
        raise NetworkError(f"{name}: cannot be read: {error.strerror or error}") from error
    except (SAXException, LookupError, ValueError) as error:
        if reader.begun:  # no fault of the parser's: ours, or sumolib's
            raise
        raise NetworkError(
            f"{name}: not well-formed XML: its encoding cannot be read, expected UTF-8"
        ) from error
    return reader.whole()


class _Reader(ContentHandler):
    """Checks each element and passes it on to sumolib.

    Attributes:
        begun: whether an element was read.
    """

    def __init__(self, name: str, foes: bool) -> None:
        super().__init__()
        self.begun = False
        self._name, self._root = name, dict[str, str]()
        self._sumolib = sumolib.net.NetReader(
            withInternal=True, withPedestrianConnections=True, withPrograms=True, withFoes=foes
        )
        self._open: list[str] = []
        self._edges: dict[str, int] = {}  # the edges that are kept, with the number of their lanes
        self._skipped: set[str] = set()  # those that sumolib leaves out
        self._edge = ""  # the one under way
        self._junctions: set[str] = set()
        self._onward: dict[str, str] = {}  # lanes inside junctions, with the next one inside
        self._light = ""  # whose program is under way
        self._letters: dict[str, int] = {}  # traffic lights, with the shortest state of theirs
        self._signals: list[tuple[int, str, str, int]] = []  # line, who, its light, its index there
        # What is referred to before it may have come: line, who refers, what, its name.
        self._wanted: list[tuple[int, str, str, str]] = []

    def whole(self) -> Read:
        """The network."""
        net = self._sumolib.getNet()
        net.initRoutingCache()
        return Read(net, self._root)

    # Calls of the parser, named as SAX has it

    def startElement(self, name: str, attrs: Any) -> None:
        """An element begins."""
        given = dict(attrs.items())
        if not self.begun:
            self.begun, self._root = True, given
            if name != "net":
                raise NetworkError(
                    f"{self._name}: a SUMO network begins with <net>, this file with <{name[:40]}>"
                )
        inside_junction = name == "junction" and given.get("id", "").startswith(":")
        if name in ELEMENTS and not inside_junction:
            self._check(name, given)
            self._note(name, given)
            if name != "param" or self._open[-1] in HOLDERS:
                self._sumolib.startElement(name, attrs)
        self._open.append(f":{name}" if inside_junction else name)

    def endElement(self, name: str) -> None:
        """An element ends."""
        self._open.pop()
        if name == "edge":
            if self._edges.get(self._edge) == 0:
                raise self._wrong(f"<edge id={shown(self._edge)}> has no <lane>")
            self._edge = ""
        elif name == "net":
            self._check_references()
        self._sumolib.endElement(name)

    def endDocument(self) -> None:
        """The file ends."""
        self._sumolib.endDocument()

    # Checks

    def _check(self, name: str, given: Mapping[str, str]) -> None:
        """Refuse attributes that are missing or none, and elements where they mean nothing."""
        must, may = ELEMENTS[name]
        for key, kind in must.items():
            if key not in given:
                raise self._wrong(f"<{name}> has no {key}, expected {kind.words}")
        for key, kind in (*must.items(), *may.items()):
            if key in given and not kind.fits(given[key]):
                raise self._wrong(f"<{name}> has {key}={shown(given[key])}, expected {kind.words}")
        parent = PARENTS.get(name)
        if parent is not None and parent not in self._open[-1:]:
            raise self._wrong(f"<{name}> stands outside of <{parent}>")

    def _note(self, name: str, given: Mapping[str, str]) -> None:
        """Keep what others refer to, and check what refers to others."""
        if name == "edge":
            self._note_edge(given)
        elif name == "lane" and self._edge:
            self._edges[self._edge] += 1
        elif name == "junction":
            if given["id"] in self._junctions:
                raise self._wrong(f"<junction id={shown(given['id'])}> is there twice")
            self._junctions.add(given["id"])
        elif name == "connection":
            self._note_connection(given)
        elif name == "tlLogic":
            self._light = given["id"]
        elif name == "phase":
            letters = len(given["state"])
            self._letters[self._light] = min(letters, self._letters.get(self._light, letters))

    def _note_edge(self, given: Mapping[str, str]) -> None:
        """An edge, with the junctions that it leads from and to, and the edges that it crosses."""
        edge, function = given["id"], given.get("function", "")
        who = f"<edge id={shown(edge)}>"
        if function in LEFT_OUT:
            self._skipped.add(edge)
            return
        if edge in self._edges:
            raise self._wrong(f"{who} is there twice")
        self._edge, self._edges[edge] = edge, 0
        if function in INSIDE:  # it is named after its junction
            self._want(who, "junction", edge[1:].rpartition("_")[0])
        else:
            for key in ("from", "to"):
                self._want(who, "junction", given.get(key, ""))
        if function == "crossing":
            if not given.get("crossingEdges"):
                raise self._wrong(f"{who} has no crossingEdges, expected ids of edges")
            for crossed in given["crossingEdges"].split(" "):
                self._want(who, "edge", crossed)
        if given.get("bidi"):
            self._want(who, "edge", given["bidi"])

    def _note_connection(self, given: Mapping[str, str]) -> None:
        """A connection from lane to lane."""
        ends = (given["from"], given["to"])
        if not self._skipped.isdisjoint(ends):
            return
        who = f"<connection from={shown(ends[0])} to={shown(ends[1])}>"
        for edge, key in zip(ends, ("fromLane", "toLane"), strict=True):
            self._check_lane(who, edge, given[key])
        if given.get("tl"):
            if not INDEX.fits(given.get("linkIndex", "")):
                raise self._wrong(f"{who} has a tl and no linkIndex of at least 0")
            self._signals.append((self._line(), who, given["tl"], int(given["linkIndex"])))
        via = given.get("via", "")
        if via:
            self._check_lane(who, *via.rpartition("_")[::2])
        if ends[0].startswith(":"):
            self._onward.setdefault(f"{ends[0]}_{int(given['fromLane'])}", via)

    def _check_lane(self, who: str, edge: str, index: str) -> None:
        """Refuse a lane that has not come before."""
        if not (INDEX.fits(index) and int(index) < self._edges.get(edge, 0)):
            raise self._wrong(f"{who}: there is no lane {shown(index)} of edge {shown(edge)}")

    def _check_references(self) -> None:
        """Refuse references to what never came, and ways through a junction without an end."""
        there = {"junction": self._junctions, "edge": self._edges}
        for line, who, what, name in self._wanted:
            if name not in there[what]:
                raise self._wrong(f"{who}: there is no {what} {shown(name)}", line)
        for line, who, light, index in self._signals:
            letters = self._letters.get(light, index + 1)
            if index >= letters:
                shortest = f"light {shown(light)} has a state of {letters} letters"
                raise self._wrong(f"{who} has linkIndex={index}, and {shortest}", line)
        for start in self._onward:
            lane, seen = start, set[str]()
            while lane in self._onward and lane not in seen:
                seen.add(lane)
                lane = self._onward[lane]
            if lane in seen:
                raise self._wrong(f"the connections via lane {shown(lane)} lead in a circle")

    def _want(self, who: str, what: str, name: str) -> None:
        """Note that something is referred to."""
        self._wanted.append((self._line(), who, what, name))

    def _wrong(self, why: str, line: int | None = None) -> NetworkError:
        """The error that says why, and in which line."""
        number = self._line() if line is None else line
        return NetworkError(f"{self._name}: cannot be read: line {number}: {why}")

    def _line(self) -> int:
        """The line of the file that is read."""
        locator: Any = self._locator  # type: ignore[attr-defined]
        return int(locator.getLineNumber())
