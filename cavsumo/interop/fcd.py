"""A trace as SUMO's floating car data, the format of ``sumo --fcd-output`` and SUMO's tools.

https://sumo.dlr.de/docs/Simulation/Output/FCDOutput.html: positions are those of the middle of the
front edge [m], angles degrees clockwise from north. The testers and the ego are among the others;
pedestrians are persons. SUMO's own values (lane, pos, slope) are left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

from cavsumo.errors import InputError
from cavsumo.model.bodies import PEDESTRIAN
from cavsumo.results.traces import Shape, Trace, states
from cavsumo.sumo.poses import to_sumo

HEADER = """<?xml version="1.0" encoding="UTF-8"?>
<fcd-export xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" \
xsi:noNamespaceSchemaLocation="http://sumo.dlr.de/xsd/fcd_file.xsd">
"""


def write_fcd(trace: Trace, file: Path) -> None:
    """Write a trace as floating car data; raises InputError when the file cannot be written."""
    shapes = trace.shapes()
    try:
        with file.open("w", encoding="utf-8") as stream:
            stream.write(HEADER)
            for frame in trace.frames:
                stream.writelines(_timestep(frame, shapes))
            stream.write("</fcd-export>\n")
    except OSError as error:
        raise InputError(f"--fcd {str(file)!r}: {error.strerror}") from error


def _timestep(frame: Mapping[str, Any], shapes: Mapping[str, Shape]) -> Iterator[str]:
    """One timestep, line by line: vehicles first, then persons, as SUMO has them."""
    lines: dict[str, list[str]] = {"vehicle": [], "person": []}
    for _, name, (x, y, v, o) in states(frame):
        shape = shapes[name]
        front_x, front_y, angle = to_sumo(x, y, o, shape.length)
        element = "person" if shape.kind == PEDESTRIAN.name else "vehicle"
        lines[element].append(
            f"        <{element} id={quoteattr(name)} x={_number(front_x)} y={_number(front_y)} "
            f"angle={_number(angle)} type={quoteattr(shape.kind)} speed={_number(v)}/>\n"
        )
    yield f'    <timestep time="{frame["time_s"]:.3f}">\n'
    yield from lines["vehicle"]
    yield from lines["person"]
    yield "    </timestep>\n"


def _number(value: float) -> str:
    """A number as an attribute, to a micrometre and the like."""
    return f'"{value:.6f}"'
