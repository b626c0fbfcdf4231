"""Files that SUMO reads because a route file or an additional file names them.

They are not kept with results, and their checksums are not in the manifest.
"""

from __future__ import annotations

import gzip
from pathlib import Path
from xml.etree import ElementTree

# The attribute that names the file, by element (SUMO's documentation, 1.28). Other attributes of
# that name are files that SUMO writes, such as those of detectors, or pictures.
READ = {"include": "href", "rerouter": "file", "variableSpeedSign": "file"}


def references(file: Path) -> list[str]:
    """The names of the files that SUMO reads because this one names them, as they stand there.

    Empty for a file that Python cannot read although SUMO can.
    """
    found: dict[str, None] = {}
    try:
        with gzip.open(file) if file.suffix == ".gz" else file.open("rb") as stream:
            events = ElementTree.iterparse(stream, events=("start", "end"))
            _, root = next(events)
            for event, element in events:
                name = element.get(READ.get(element.tag, ""), "") if event == "start" else ""
                if name:
                    found[name] = None
                if event == "end":
                    root.clear()
    except (ElementTree.ParseError, LookupError, ValueError, OSError, StopIteration):
        return []
    return list(found)
