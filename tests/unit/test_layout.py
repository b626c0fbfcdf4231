"""The layout: which room may use which, who touches SUMO, and what an import costs."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path

import cavsumo

PACKAGE = Path(cavsumo.__file__).parent

# In order: each room with the rooms before it that it uses, lazily or not. Errors and the version
# stand at the root, for all of them.
ROOMS = {
    room: frozenset(uses.split())
    for room, uses in {
        "model": "",
        "games": "model",
        "suites": "model",
        "network": "model",
        "agents": "model games",
        "assertions": "model network agents",
        "openscenario": "model network agents",
        "egos": "model agents assertions",
        "sumo": "model network egos",
        "simulation": "model network agents assertions egos sumo",
        "results": "model suites network agents assertions egos sumo simulation",
        "searchers": "model network agents",
        "probability": "model games network agents searchers",
        "batch": "model suites network agents assertions egos sumo simulation results searchers "
        "probability",
        "kept": "model network agents assertions egos results searchers batch",
        "report": "model suites network assertions egos results probability batch kept",
        "interop": "model network sumo results",
        "api": "model suites network agents openscenario batch kept report results",
        "envs": "model network agents assertions egos simulation results batch",
        "testing": "model network agents assertions egos",
        "cli": "model games suites network agents openscenario assertions egos results batch kept "
        "report interop testing",
    }.items()
}
ROOT = {"__init__", "__main__", "errors"}

OPTIONAL = {"IPython", "PIL", "dask", "distributed", "numba", "osmium", "pettingzoo", "pytest"}
OPTIONAL |= {"ribs", "scenariogeneration"}
OPTIONAL |= {"traci"}  # libsumo brings it


def sources() -> dict[str, Path]:
    """Every module of the package with its file, by its name without ``cavsumo.``."""
    found = {}
    for file in sorted(PACKAGE.rglob("*.py")):
        parts = file.relative_to(PACKAGE).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" and parts[1:] else parts)] = file
    return found


SOURCES = sources()


@cache
def trees() -> dict[str, ast.Module]:
    """Every module of the package, parsed."""
    return {name: ast.parse(file.read_text(encoding="utf-8")) for name, file in SOURCES.items()}


def imported(module: str) -> Iterator[str]:
    """The full names of all modules that a module imports, inside functions too."""
    for node in ast.walk(trees()[module]):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}: relative import"
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                yield whole if whole.removeprefix("cavsumo.") in SOURCES else str(node.module)


def used(module: str) -> set[str]:
    """The modules of the package that a module imports."""
    names = {name for name in imported(module) if name.startswith("cavsumo.")}
    return {name.removeprefix("cavsumo.") for name in names}


def room(module: str) -> str:
    """The room in which a module stands; empty for the root."""
    first = module.split(".")[0]
    return "" if first in ROOT else first


def cycles(graph: Mapping[str, Iterable[str]]) -> list[list[str]]:
    """The strongly connected components of more than one node (Tarjan 1972)."""
    number: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(node: str) -> None:
        number[node] = lowest[node] = len(number)
        stack.append(node)
        for other in graph.get(node, ()):
            if other not in number:
                visit(other)
                lowest[node] = min(lowest[node], lowest[other])
            elif other in stack:
                lowest[node] = min(lowest[node], number[other])
        if lowest[node] == number[node]:
            place = stack.index(node)
            found.append(sorted(stack[place:]))
            del stack[place:]

    for node in graph:
        if node not in number:
            visit(node)
    return [component for component in found if len(component) > 1]


def test_what_is_imported_is_required_or_has_an_extra() -> None:
    """``pip install cavsumo`` brings all packages but those of the extras: pictures need none."""
    project = tomllib.loads((PACKAGE.parent / "pyproject.toml").read_text("utf-8"))["project"]
    core = {re.split(r"[\[>=]", word)[0] for word in project["dependencies"]}
    names = {name.partition(".")[0] for module in SOURCES for name in imported(module)}
    others = names - sys.stdlib_module_names - core - {"cavsumo", "markupsafe"}  # jinja2 brings it
    assert others == OPTIONAL


def test_the_root_holds_three_files() -> None:
    """Everything else stands in a room."""
    assert {file.stem for file in PACKAGE.glob("*.py")} == ROOT
    rooms = {folder.parent.name for folder in PACKAGE.glob("*/__init__.py")}
    assert rooms == set(ROOMS)


def test_a_room_uses_only_the_rooms_that_it_names() -> None:
    """Imports point one way, so each room can be read, tested and replaced by itself."""
    found: dict[str, set[str]] = {name: set() for name in ROOMS}
    for module in SOURCES:
        if here := room(module):
            found[here] |= {room(name) for name in used(module)} - {here, ""}
    assert found == ROOMS


def test_a_room_names_only_rooms_before_it() -> None:
    """The order of the list is the order of the house."""
    for place, (name, uses) in enumerate(ROOMS.items()):
        assert uses <= set(list(ROOMS)[:place]), name


def test_no_files_import_each_other() -> None:
    """No cycle, within rooms and across them, lazy imports included."""
    assert cycles({module: used(module) for module in SOURCES}) == []


def test_cycles_are_found() -> None:
    """The search itself: one cycle of three, one of two, and a node before them."""
    graph = {"a": "b", "b": "cd", "c": "e", "e": "b", "d": "f", "f": "d"}
    assert sorted(cycles(graph)) == [["b", "c", "e"], ["d", "f"]]
    assert cycles({"a": "bc", "b": "c", "c": ""}) == []


def test_only_the_boundary_imports_sumo() -> None:
    """One room simulates, even lazily; traci only shows."""
    users: dict[str, set[str]] = defaultdict(set)
    for module in SOURCES:
        for name in {name.split(".")[0] for name in imported(module)} & {"libsumo", "traci"}:
            users[name].add(room(module))
    assert users == {"libsumo": {"sumo"}, "traci": {"interop"}}


def test_a_class_name_has_one_meaning() -> None:
    """No two classes of the package have the same name."""
    places: dict[str, list[str]] = defaultdict(list)
    for module, tree in trees().items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                places[node.name].append(module)
    assert {name: at for name, at in places.items() if len(at) > 1} == {}


def test_every_room_says_what_lives_there() -> None:
    """Ten lines at most: what lives there, what does not, where to add one more."""
    for name in ROOMS:
        text = ast.get_docstring(trees()[name])
        assert text, name
        assert len(text.splitlines()) <= 10, name


def docstrings() -> Iterator[tuple[str, str]]:
    """Every docstring of the package with the name of its module."""
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    for module, tree in trees().items():
        for node in ast.walk(tree):
            if isinstance(node, kinds) and (text := ast.get_docstring(node)):
                yield module, text


def test_a_docstring_begins_with_a_noun_or_a_verb() -> None:
    """It names its subject instead of asking for it."""
    begins = re.compile(r"(what|who)(ever|m|se)?\b", re.IGNORECASE)
    assert [(module, text) for module, text in docstrings() if begins.match(text)] == []


def test_sentences_name_their_subject() -> None:
    """Neither the package nor the documentation writes of whatever, whoever or whom."""
    root = PACKAGE.parent
    files = [*PACKAGE.rglob("*.py"), *root.glob("*.md"), *root.glob("docs/*.md")]
    files += [root / folder / "README.md" for folder in ("benchmarks", "experiments", "networks")]
    word = re.compile(r"\b(whatever|whoever|whom)\b", re.IGNORECASE)
    found = [
        (str(file.relative_to(root)), line)
        for file in files
        for line in file.read_text(encoding="utf-8").splitlines()
        if word.search(line)
    ]
    assert found == []
