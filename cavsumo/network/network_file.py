"""A network's file: whether it is there and is one of SUMO's; nothing heavy is imported."""

from __future__ import annotations

import gzip
import zlib
from pathlib import Path
from typing import IO, cast
from xml.etree import ElementTree

from cavsumo.errors import NetworkError


def root_of(file: Path) -> dict[str, str]:
    """The attributes of a network's <net>.

    Raises NetworkError for a file that is not there, is not XML, or is other XML.
    """
    try:
        if file.is_dir():
            raise NetworkError(f"network {str(file)!r}: is a folder, expected a .net.xml")
        if not file.is_file():
            raise NetworkError(f"network {str(file)!r}: no such file{_neighbours(file)}")
        with opened(file) as stream:
            _, root = next(ElementTree.iterparse(stream, events=("start",)))
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise NetworkError(f"network {str(file)!r}: not well-formed XML: a damaged .gz") from error
    except OSError as error:
        said = error.strerror or error
        raise NetworkError(f"network {str(file)!r}: cannot be read: {said}") from error
    except ElementTree.ParseError as error:
        raise NetworkError(f"network {str(file)!r}: not well-formed XML: {error}") from error
    except (LookupError, ValueError) as error:
        raise NetworkError(
            f"network {str(file)!r}: not well-formed XML: its encoding cannot be read, expected "
            "UTF-8"
        ) from error
    if root.tag != "net":
        raise NetworkError(
            f"network {str(file)!r}: a SUMO network begins with <net>, this file with "
            f"<{root.tag[:40]}>"
        )
    return dict(root.attrib)


def opened(file: Path) -> IO[bytes]:
    """The content of a file, packed with gzip or not."""
    with file.open("rb") as raw:
        packed = raw.read(2) == b"\x1f\x8b"
    return cast("IO[bytes]", gzip.open(file)) if packed else file.open("rb")


def _neighbours(file: Path) -> str:
    """Names the networks that lie where the missing one was looked for."""
    if not file.parent.is_dir():
        return ""
    found = sorted(p.name for p in file.parent.glob("*.net.xml*"))
    return f"; {str(file.parent)!r} holds {', '.join(found[:6])}" if found else ""
