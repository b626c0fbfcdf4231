"""Rebuild the networks of the suites of tests: straight roads and a crossing, of our own.

    pip install '.[osm]' eclipse-sumo==1.28.0
    python networks/build_proving.py

Every road of the proving grounds has two lanes of 3.5 m each way; the inner ones lie 1.75 m beside
the centre line, as in Euro NCAP's protocols, and the outer ones are room for parked cars. The
street of Chance et al. (arXiv 1912.05434) has a lane of 6 m and a pavement of 3 m each way. The
same version gives the same bytes.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from build import NETWORKS, OWN, ROAD_OPTIONS, publish

from cavsumo.network.osm.netconvert import netconvert

ROAD_M, ARM_M = 800.0, 450.0  # from the middle to each end
STREET_M = -20.0, 99.0  # the ego enters before the pavements where people begin
INNER_M = 8.0  # radius of the kerbs, as in the protocols
SPEED = 55.56  # m/s; a case sets its own

NODE = '    <node id="{}" x="{:g}" y="{:g}" type="{}"/>\n'
EDGE = (
    '    <edge id="{}" from="{}" to="{}" numLanes="2" speed="{}" priority="{}">\n'
    '        <lane index="0" width="3.50"/>\n        <lane index="1" width="3.50"/>\n    </edge>\n'
)
WIDE = (
    '    <edge id="{}" from="{}" to="{}" numLanes="2" speed="13.89" spreadType="right">\n'
    '        <lane index="0" allow="pedestrian" width="3.00"/>\n'
    '        <lane index="1" disallow="pedestrian" width="6.00"/>\n    </edge>\n'
)
LINK = '    <connection from="{}" to="{}" fromLane="{}" toLane="{}"/>\n'
ARMS = {"west": (-1.0, 0.0), "south": (0.0, -1.0), "east": (1.0, 0.0), "north": (0.0, 1.0)}


def road() -> dict[str, str]:
    """Nodes and edges of the straight road, with its middle at the origin."""
    nodes = NODE.format("west", -ROAD_M, 0.0, "dead_end") + NODE.format(
        "east", ROAD_M, 0.0, "dead_end"
    )
    edges = EDGE.format("eastbound", "west", "east", SPEED, 1)
    edges += EDGE.format("westbound", "east", "west", SPEED, 1)
    return {"nod": f"<nodes>\n{nodes}</nodes>\n", "edg": f"<edges>\n{edges}</edges>\n"}


def street() -> dict[str, str]:
    """Nodes and edges of the street of Chance et al., its middle at y = 0."""
    ends = zip(("west", "east"), STREET_M, strict=True)
    nodes = "".join(NODE.format(name, x, 0.0, "dead_end") for name, x in ends)
    edges = WIDE.format("eastbound", "west", "east") + WIDE.format("westbound", "east", "west")
    return {"nod": f"<nodes>\n{nodes}</nodes>\n", "edg": f"<edges>\n{edges}</edges>\n"}


def crossing() -> dict[str, str]:
    """Nodes, edges and connections of four arms that meet at the origin."""
    nodes = f'    <node id="middle" x="0" y="0" type="priority" radius="{INNER_M:g}"/>\n'
    edges = links = ""
    for arm, (x, y) in ARMS.items():
        nodes += NODE.format(arm, ARM_M * x, ARM_M * y, "dead_end")
        priority = 2 if y == 0.0 else 1
        edges += EDGE.format(f"{arm}_in", arm, "middle", SPEED, priority)
        edges += EDGE.format(f"{arm}_out", "middle", arm, SPEED, priority)
        for other in ARMS:
            if other != arm:
                links += LINK.format(f"{arm}_in", f"{other}_out", 1, 1)
    return {
        "nod": f"<nodes>\n{nodes}</nodes>\n",
        "edg": f"<edges>\n{edges}</edges>\n",
        "con": f"<connections>\n{links}</connections>\n",
    }


def build(name: str, files: dict[str, str], work: Path) -> None:
    """Make one network."""
    kinds = {"nod": "node-files", "edg": "edge-files", "con": "connection-files"}
    for ending, text in files.items():
        (work / f"{name}.{ending}.xml").write_text(text, encoding="utf-8")
    options = [f"{kinds[ending]}={name}.{ending}.xml" for ending in files]
    options += [*ROAD_OPTIONS, f"output-file={name}.net.xml"]
    netconvert(options, work)
    publish(work / f"{name}.net.xml", NETWORKS / f"{name}.net.xml", OWN, options)


def main() -> None:
    """Build the networks."""
    with tempfile.TemporaryDirectory() as folder:
        build("proving-road", road(), Path(folder))
        build("wide-street", street(), Path(folder))
        build("proving-crossing", crossing(), Path(folder))


if __name__ == "__main__":
    main()
