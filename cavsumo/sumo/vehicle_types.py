"""The vehicle types of the ego and the testers for SUMO, as an additional file."""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

from cavsumo.egos.base import Ego
from cavsumo.model.bodies import CAR, KINDS, PEDESTRIAN, Body, Kind
from cavsumo.model.scenario import Scenario


def type_file(scenario: Scenario, ego: Ego) -> str:
    """An additional file with the vehicle types of the ego and of the tester's bodies."""
    types = [("cavsumo_ego", {"vClass": "passenger"} | ego.vtype())]
    for kind in KINDS.values():
        shape = _shape(scenario, kind)
        types.append((f"cavsumo_{kind.name}", {"vClass": "passenger"} | shape))
        if kind is PEDESTRIAN:
            types.append(("cavsumo_person", {"vClass": "pedestrian"} | shape))
    for body in scenario.script.bodies if scenario.script else ():
        shape = _shape(scenario, body.kind)
        types.append((type_of(scenario, body), {"vClass": "passenger"} | shape))
    rows = [
        f"  <vType id={quoteattr(name)} "
        + " ".join(f"{k}={quoteattr(v)}" for k, v in attributes.items())
        + "/>"
        for name, attributes in types
    ]
    return "\n".join(["<additional>", *rows, "</additional>", ""])


def _shape(scenario: Scenario, kind: Kind) -> dict[str, str]:
    """The attributes that tell SUMO the box of a kind."""
    seen = scenario.sumo_width if kind.name == PEDESTRIAN.name else kind.width
    drawn = "passenger" if kind.name == CAR.name else kind.name
    return {"length": f"{kind.length}", "width": f"{seen}", "minGap": "0", "guiShape": drawn}


def type_of(scenario: Scenario, body: Body) -> str:
    """The vehicle type of a tester's body; each body of a script has one of its own."""
    return f"cavsumo_{body.kind.name if scenario.script is None else body.id}"
