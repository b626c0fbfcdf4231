"""The vehicle types of the ego and the testers for SUMO, as an additional file."""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

from cavsumo.egos.base import Ego
from cavsumo.model.bodies import CAR, KINDS, PEDESTRIAN
from cavsumo.model.scenario import Scenario


def type_file(scenario: Scenario, ego: Ego) -> str:
    """An additional file with the vehicle types of the ego and of the tester's bodies."""
    types = [("cavsumo_ego", {"vClass": "passenger"} | ego.vtype())]
    for kind in KINDS.values():
        seen = scenario.sumo_width if kind is PEDESTRIAN else kind.width
        shape = {"length": f"{kind.length}", "width": f"{seen}", "minGap": "0"}
        shape |= {"guiShape": "passenger" if kind is CAR else kind.name}
        types.append((f"cavsumo_{kind.name}", {"vClass": "passenger"} | shape))
        if kind is PEDESTRIAN:
            types.append(("cavsumo_person", {"vClass": "pedestrian"} | shape))
    rows = [
        f"  <vType id={quoteattr(name)} "
        + " ".join(f"{k}={quoteattr(v)}" for k, v in attributes.items())
        + "/>"
        for name, attributes in types
    ]
    return "\n".join(["<additional>", *rows, "</additional>", ""])
