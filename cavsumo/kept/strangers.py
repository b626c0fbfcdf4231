"""The inputs of a stranger's test, of which SUMO is to simulate and nothing else.

SUMO's files may name files that it writes or reads: detectors, saved states, devices, includes. So
a test that is not trusted may have no additional files and no routes (its traffic is told by
departures), and its network only holds what netconvert writes.
"""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

from cavsumo.batch.replay import Record
from cavsumo.errors import InputError, shown
from cavsumo.network.net_format import ELEMENTS
from cavsumo.network.network_file import opened

KNOWN = frozenset({*ELEMENTS, "restriction", "stopOffset", "prohibition"})
FILES = re.compile("file|output", re.IGNORECASE)  # in the key of a parameter that names a file


def check_inputs(record: Record, file: Path) -> None:
    """Raise InputError when SUMO would do more with the inputs of a test than simulate.

    ``file``: of the test, for the message.
    """
    scenario, trace = record.plan.scenario, record.trace
    assert trace is not None
    found = _beyond(scenario.net_file)
    if scenario.additional:
        found = "has additional files of SUMO, which may name files to write"
    elif trace.head.get("departures") is None:
        found = "has routes, which may name files to write"
    if found:
        raise InputError(f"test {str(file)!r}: {found}; --trust allows it")


def _beyond(net: Path) -> str:
    """The part of a network that may name a file, in words; empty for none."""
    try:
        with opened(net) as stream:
            for _, element in ElementTree.iterparse(stream):
                tag, key = str(element.tag), element.get("key", "")
                if tag not in KNOWN:
                    return f"its network holds {shown(tag)}, which may name a file to write"
                if tag == "param" and FILES.search(key):
                    return f"its network holds the parameter {shown(key)}"
                if tag in ("edge", "junction", "tlLogic"):
                    element.clear()
    except (OSError, EOFError, ElementTree.ParseError, ValueError, LookupError):
        return ""  # refused where the network is read
    return ""
