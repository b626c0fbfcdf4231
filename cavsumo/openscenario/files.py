"""The files that a scenario names: within one folder only, each read once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from cavsumo.errors import InputError, UnknownName, shown
from cavsumo.model.expressions import Value
from cavsumo.openscenario.nodes import XmlNode, value_of
from cavsumo.openscenario.tree import XmlElement, read_xml
from cavsumo.openscenario.vocabulary import check_root, check_understood

FILES = 200  # of a folder of catalogs
ROOT = "--scenario-root"
TYPES = {
    "double": float,
    "integer": int,
    "int": int,
    "unsignedInt": int,
    "unsignedShort": int,
}


@dataclass
class ScenarioFiles:
    """The files of a scenario.

    Attributes:
        file: the scenario's.
        root: the folder that they must be in.
        folders: of catalogs.
    """

    file: Path
    root: Path
    folders: list[Path] = field(default_factory=list)
    _entries: dict[tuple[str, str], XmlElement] | None = None

    def path(self, node: XmlNode, key: str) -> Path:
        """The file or folder that an attribute names, relative to the scenario's file."""
        text = node.word(key)
        path = self.file.parent / text
        try:
            inside = path.resolve().is_relative_to(self.root.resolve())
        except (OSError, ValueError, RuntimeError):
            inside = False
        if not inside or "\0" in text:
            raise node.refused(
                f"{key}: {shown(text)} is outside of {str(self.root)!r}; {ROOT} FOLDER names the "
                "folder that the files of a scenario may come from"
            )
        return path

    def entry(self, reference: XmlNode) -> XmlNode:
        """The element of a catalog that a CatalogReference names, with its parameters."""
        if self._entries is None:
            self._entries = dict(self._read())
        catalog, name = reference.word("catalogName"), reference.word("entryName")
        found = self._entries.get((catalog, name))
        if found is None:
            names = [entry for c, entry in self._entries if c == catalog]
            known = names or sorted({c for c, _ in self._entries})
            what = f"entry of catalog {catalog!r}" if names else "catalog"
            place = f"{reference.xml.file!r}: line {reference.xml.line}"
            raise UnknownName(what, name if names else catalog, known, place)
        given = reference.maybe("ParameterAssignments")
        assigned = {one.word("parameterRef"): one for one in given.all()} if given else {}
        check_understood(found)
        own = declared(
            XmlNode(found, {}), {key: one.word("value") for key, one in assigned.items()}
        )
        for key, one in assigned.items():
            if key not in own:
                raise one.refused(f"{name} of catalog {catalog!r} has no parameter {key!r}")
        return XmlNode(found, own)

    def _read(self) -> Iterator[tuple[tuple[str, str], XmlElement]]:
        """All entries of the catalogs."""
        for folder in self.folders:
            try:
                files = sorted(folder.glob("*.xosc")) if folder.is_dir() else []
            except OSError:
                files = []
            if not files:
                raise InputError(f"{str(self.file)!r}: no catalogs (.xosc) in {str(folder)!r}")
            if len(files) > FILES:
                raise InputError(f"{str(folder)!r}: more than {FILES} catalogs")
            for file in files:
                if not file.resolve().is_relative_to(self.root.resolve()):
                    raise InputError(f"{str(file)!r}: is outside of {str(self.root)!r} ({ROOT})")
                root = check_root(read_xml(file, "catalog"))
                for catalog in (one for one in root.inner if one.tag == "Catalog"):
                    for one in catalog.inner:
                        yield (catalog.given.get("name", ""), one.given.get("name", "")), one


def declared(node: XmlNode, given: dict[str, str]) -> dict[str, Value]:
    """The values of the parameters that an element declares, in place of those around it.

    ``given``: values by name in place of those of the file. Constraints must hold.
    """
    scope: dict[str, Value] = dict(node.scope)
    holder = node.maybe("ParameterDeclarations")
    for one in holder.all("ParameterDeclaration") if holder else ():
        name = one.word("name")
        here = one.within(scope)
        if name in given:
            value: Value = given[name]
        else:
            value = here.number("value") if _numeric(here) else here.word("value")
        scope[name] = _typed(here, value)
        _check_constraints(one.within(scope), name)
    return scope


def _numeric(node: XmlNode) -> bool:
    """Whether a declaration is of a number."""
    return node.word("parameterType") in TYPES


def _typed(node: XmlNode, value: Value) -> Value:
    """A value of the type of its declaration."""
    if not _numeric(node):
        return str(value)
    try:
        number = float(value_of(str(value), node.scope))
    except (ValueError, TypeError):
        raise node.refused(f"{node.word('name')}: expected a number, got {shown(value)}") from None
    return int(number) if number.is_integer() and node.word("parameterType") != "double" else number


def _check_constraints(node: XmlNode, name: str) -> None:
    """Raise InputError unless all constraints of one group hold."""
    groups = list(node.all("ConstraintGroup"))
    value = node.scope[name]
    if groups and not any(all(_holds(one, value) for one in group.all()) for group in groups):
        said = [
            " and ".join(f"{one.word('rule')} {one.word('value')}" for one in group.all())
            for group in groups
        ]
        raise node.refused(f"{name} is {shown(value)}, expected {' or '.join(said)}")


def _holds(constraint: XmlNode, value: Value) -> bool:
    """Whether a value has the wanted relation to that of a constraint."""
    return compared(constraint.word("rule"), value, constraint.word("value"), constraint)


def compared(rule: str, a: Value, b: Value, node: XmlNode) -> bool:
    """Whether a rule holds between two values, as numbers where both are."""
    try:
        x, y = float(a), float(b)
    except (ValueError, TypeError):
        if rule not in ("equalTo", "notEqualTo"):
            raise node.refused(f"{rule}: expected numbers, got {shown(a)}, {shown(b)}") from None
        return (str(a) == str(b)) == (rule == "equalTo")
    rules = {
        "greaterThan": x > y,
        "greaterOrEqual": x >= y,
        "lessThan": x < y,
        "lessOrEqual": x <= y,
        "equalTo": x == y,
        "notEqualTo": x != y,
    }
    if rule not in rules:
        raise UnknownName("rule", rule, rules, f"{node.xml.file!r}: line {node.xml.line}")
    return rules[rule]
