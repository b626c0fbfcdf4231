"""Entities: their boxes, and the kinds of bodies that they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cavsumo.errors import UnknownName
from cavsumo.model.bodies import BICYCLE, BUS, CAR, PEDESTRIAN
from cavsumo.openscenario.files import ScenarioFiles, declared
from cavsumo.openscenario.nodes import XmlNode

LARGEST_M = 50.0
VEHICLES: Mapping[str, str] = {
    "bicycle": BICYCLE.name,
    "bus": BUS.name,
    "car": CAR.name,
    "motorbike": BICYCLE.name,
    "semitrailer": BUS.name,
    "trailer": BUS.name,
    "truck": BUS.name,
    "van": CAR.name,
}
PEDESTRIANS: Mapping[str, str] = {
    "pedestrian": PEDESTRIAN.name,
    "wheelchair": PEDESTRIAN.name,
}


@dataclass(frozen=True)
class Entity:
    """An entity.

    Attributes:
        name: in the scenario.
        kind: of its body.
        length, width: of its box [m].
        ahead: how far the middle of the box is before the reference point [m].
        node: its element.
    """

    name: str
    kind: str
    length: float
    width: float
    ahead: float
    node: XmlNode

    @property
    def front(self) -> float:
        """From the reference point to the front [m]."""
        return self.ahead + self.length / 2


def entities_of(root: XmlNode, files: ScenarioFiles) -> dict[str, Entity]:
    """The entities of a scenario, by their names in the order of the file."""
    found: dict[str, Entity] = {}
    for one in root.one("Entities").all("ScenarioObject"):
        name = one.word("name")
        if name in found:
            raise one.refused(f"{name!r} is named twice")
        found[name] = _entity(name, one, files)
    return found


def _entity(name: str, holder: XmlNode, files: ScenarioFiles) -> Entity:
    """One entity."""
    node = holder.one("CatalogReference", "Vehicle", "Pedestrian", "MiscObject")
    named = node.tag == "CatalogReference"
    node = files.entry(node) if named else node.within(declared(node, {}))
    kind = _kind(node)
    box = node.one("BoundingBox")
    middle, size = box.one("Center"), box.one("Dimensions")
    if abs(middle.number("y")) > 1e-6:
        raise middle.refused("y: expected 0, boxes beside their reference point are not understood")
    length, width = size.number("length"), size.number("width")
    if not all(0.0 < value <= LARGEST_M for value in (length, width)):
        raise size.refused(f"expected a length and a width up to {LARGEST_M:g} m")
    return Entity(name, kind, length, width, middle.number("x"), holder)


def _kind(node: XmlNode) -> str:
    """The kind of a body."""
    if node.tag == "MiscObject":
        return CAR.name  # it hides others as a car does
    key, kinds = (
        ("vehicleCategory", VEHICLES)
        if node.tag == "Vehicle"
        else ("pedestrianCategory", PEDESTRIANS)
    )
    category = node.word(key)
    if category not in kinds:
        place = f"{node.xml.file!r}: line {node.xml.line}: <{node.tag}>"
        raise UnknownName(key, category, kinds, place)
    return kinds[category]
