"""XML of strangers as a tree with the lines of its elements, within bounds.

A document type is refused, and with it entities and references to other files.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from cavsumo.errors import InputError
from cavsumo.model.documents import read_bytes

LARGEST_B = 8 << 20
DEPTH = 60  # of elements in each other
MOST = 200_000  # elements
LONGEST = 2_000  # characters of a value


@dataclass
class XmlElement:
    """An element of a file.

    Attributes:
        tag: its name.
        given: its attributes.
        line: on which it begins.
        file: in which it is, as messages name it.
        inner: the elements in it.
    """

    tag: str
    given: dict[str, str]
    line: int
    file: str
    inner: list[XmlElement] = field(default_factory=list)

    def refused(self, why: str) -> InputError:
        """The error that gives a reason, with file, line and element."""
        return InputError(f"{self.file!r}: line {self.line}: <{self.tag}>: {why}")

    def everything(self) -> Iterator[XmlElement]:
        """This element and all in it."""
        yield self
        for one in self.inner:
            yield from one.everything()


def read_xml(file: Path, what: str) -> XmlElement:
    """The root of a file; raises InputError in one sentence for any other content."""
    name = f"{what} {str(file)!r}"
    data = read_bytes(file, what, largest=LARGEST_B)
    builder = _Builder(name, str(file))
    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.StartDoctypeDeclHandler = builder.doctype
    builder.parser = parser
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        said = expat.errors.messages[error.code]
        raise InputError(f"{name}: line {error.lineno}: not well-formed XML: {said}") from error
    except (LookupError, ValueError) as error:
        raise InputError(
            f"{name}: not well-formed XML: its encoding cannot be read, expected UTF-8"
        ) from error
    assert builder.root is not None
    return builder.root


class _Builder:
    """The handlers of the parser."""

    def __init__(self, name: str, file: str) -> None:
        self._name, self._file, self._open, self._count = name, file, list[XmlElement](), 0
        self.root: XmlElement | None = None
        self.parser: expat.XMLParserType

    def start(self, tag: str, given: dict[str, str]) -> None:
        """An element begins."""
        self._count += 1
        if len(self._open) >= DEPTH:
            raise self._refused(f"elements in each other, more than {DEPTH} deep")
        if self._count > MOST:
            raise self._refused(f"more than {MOST} elements")
        for key, value in given.items():
            if len(value) > LONGEST:
                raise self._refused(f"{key[:40]}: a value of more than {LONGEST} characters")
        element = XmlElement(tag, given, self.parser.CurrentLineNumber, self._file)
        if self._open:
            self._open[-1].inner.append(element)
        else:
            self.root = element
        self._open.append(element)

    def end(self, tag: str) -> None:
        """An element ends."""
        self._open.pop()

    def doctype(self, *_: object) -> None:
        """A document type, which could define entities."""
        raise self._refused("a document type (DOCTYPE), which no scenario needs")

    def _refused(self, why: str) -> InputError:
        return InputError(f"{self._name}: line {self.parser.CurrentLineNumber}: {why}")
