"""A network's file: whether it is there and is one of SUMO's; nothing heavy is imported."""

from __future__ import annotations

import gzip
import zlib
from pathlib import Path
from xml.etree import ElementTree

from cavsumo.errors import NetworkError


def root_of(file: Path) -> dict[str, str]:
    """The attributes of a network's <net>.

    Raises NetworkError for a file that is not there, is not XML, or is other XML.
    """
    if file.is_dir():
        raise NetworkError(f"network {str(file)!r}: is a folder, expected a .net.xml")
    if not file.is_file():
        raise NetworkError(f"network {str(file)!r}: no such file{_neighbours(file)}")
    opener = gzip.open if file.suffix == ".gz" else open
    try:
        with opener(file, "rb") as stream:
            _, root = next(ElementTree.iterparse(stream, events=("start",)))
    except (ElementTree.ParseError, OSError, EOFError, zlib.error) as error:
        raise NetworkError(f"network {str(file)!r}: not well-formed XML: {error}") from error
    if root.tag != "net":
        raise NetworkError(
            f"network {str(file)!r}: a SUMO network begins with <net>, this file with <{root.tag}>"
        )
    return dict(root.attrib)


def _neighbours(file: Path) -> str:
    """Names the networks that lie where the missing one was looked for."""
    if not file.parent.is_dir():
        return ""
    found = sorted(p.name for p in file.parent.glob("*.net.xml*"))
    return f"; {str(file.parent)!r} holds {', '.join(found[:6])}" if found else ""
