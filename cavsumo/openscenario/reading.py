"""A scenario's file as the settings of a batch: a script, the network under it, its assertions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cavsumo.errors import UnknownName
from cavsumo.model.expressions import Value
from cavsumo.openscenario.entities import entities_of
from cavsumo.openscenario.files import ScenarioFiles, declared
from cavsumo.openscenario.ground import ground_of
from cavsumo.openscenario.nodes import XmlNode
from cavsumo.openscenario.placing import Beginnings
from cavsumo.openscenario.roads import RoadMap
from cavsumo.openscenario.scripting import script_of
from cavsumo.openscenario.tree import XmlElement, read_xml
from cavsumo.openscenario.vocabulary import WITHOUT_EFFECT, check_root, check_understood

STEP_S = 0.02  # a timestep, unless the user gives another


@dataclass(frozen=True)
class ScenarioSource:
    """A scenario that is to be played.

    Attributes:
        file: the scenario's.
        values: of its parameters, by name.
        root: the folder that all its files must be in; its own if not given.
        ego: the name of the entity under test.
        step: length of a timestep [s].
    """

    file: Path
    values: Mapping[str, str]
    root: Path | None = None
    ego: str = "Ego"
    step: float = STEP_S


@dataclass(frozen=True)
class ReadScenario:
    """A scenario as a batch plays it.

    Attributes:
        settings: of the batch.
        places: present paths of files that were made for it.
        notes: what to tell the user, a sentence each.
    """

    settings: dict[str, Any]
    places: dict[str, Path]
    notes: tuple[str, ...]


def read_scenario(source: ScenarioSource) -> ReadScenario:
    """Read a scenario; raises InputError in one sentence, with file, line and element."""
    file = source.file
    root = check_root(read_xml(file, "scenario"))
    check_understood(root)
    files = ScenarioFiles(file, source.root or file.parent)
    whole = XmlNode(root)
    whole = whole.within(_parameters(whole, source))
    locations = whole.maybe("CatalogLocations")
    for one in locations.all() if locations else ():
        files.folders.append(files.path(one.one("Directory"), "path"))
    files.folders = list(dict.fromkeys(files.folders))
    roads = _roads(whole, files)
    entities = entities_of(whole, files)
    if source.ego not in entities:
        raise UnknownName("entity", source.ego, entities, f"{str(file)!r}: the ego")
    board = whole.one("Storyboard")
    beginnings = Beginnings(entities, board.one("Init"), files, roads, _variables(whole))
    ego = beginnings.of(board, source.ego)
    if ego.speed == 0.0:
        raise ego.entity.node.refused(f"{source.ego} needs a speed at the beginning")
    ground = ground_of(ego, roads)
    made = script_of(file.stem, source.ego, source.step, beginnings, board, ground)
    settings = {
        "net": str(ground.net),
        "routes": "none",
        "ego_route": list(ground.route),
        "script": made.model_dump(mode="json", exclude_none=True)
        | {"parameters": dict(source.values)},
    }
    back = f"{source.ego} drives backwards: played as a vehicle with its rear as its front"
    notes = [ground.note, back if ego.backwards else "", *_without_effect(root)]
    return ReadScenario(settings, ground.places, tuple(note for note in notes if note))


def _parameters(whole: XmlNode, source: ScenarioSource) -> dict[str, Value]:
    """The values of the parameters."""
    holder = whole.maybe("ParameterDeclarations")
    names = [one.word("name") for one in holder.all()] if holder else []
    for name in source.values:
        if name not in names:
            raise UnknownName("parameter", name, names, str(source.file))
    return declared(whole, dict(source.values))


def _roads(whole: XmlNode, files: ScenarioFiles) -> RoadMap | None:
    """The road network of a scenario."""
    network = whole.maybe("RoadNetwork")
    logic = network.maybe("LogicFile") if network else None
    if logic is None or not logic.word("filepath"):
        return None
    path = files.path(logic, "filepath")
    if not path.is_file():
        raise logic.refused(f"filepath: no such file: {str(path)!r}")
    return RoadMap(path)


def _without_effect(root: XmlElement) -> list[str]:
    """A sentence about the elements that are read and have no effect."""
    found = [one for one in root.everything() if one.tag in WITHOUT_EFFECT]
    said = [f"<{one.tag}> (line {one.line})" for one in found]
    return [f"without effect here: {', '.join(said)}"] if said else []


def _variables(whole: XmlNode) -> dict[str, str]:
    """The variables of a scenario with their values at the beginning."""
    holder = whole.maybe("VariableDeclarations")
    return {one.word("name"): one.word("value") for one in holder.all()} if holder else {}
