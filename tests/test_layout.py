"""The layout: which module may use which, who touches SUMO, and what an import costs."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import cavsumo

PACKAGE = Path(cavsumo.__file__).parent

# From the ground up: a module uses only what stands before it, lazily or not.
ORDER = """
    cavsumo errors checks registry
    games.model games.build games.files games.readings games.regions games.components
    games.solvable games.policies games.chains games.evaluation games.proper games.certificate
    games.flow games.arena games.kernel games.backups games.matrix_games games.pairs games.plays
    games.solve games games.drawing games.pictures
    kinematics geometry paths bodies snapshot fairness roads
    sumo_poses background
    network ego_routes lane_chains approaches starts vehicle_starts kerbs signals trips traffic
    site scene
    osm handedness netconvert facts inspection layers picture
    agents.base agents.walking agents.driving agents.triggers agents.random agents.features
    agents.manoeuvres agents.behaviours agents.programmed agents.election agents.qlearning agents
    contacts
    assertions.base assertions.collision assertions.reaction_zone assertions
    egos.base egos.constant egos.sumo egos.time_gap egos.controller egos
    options scenario outcomes rewards sumo_types demand simulations world
    jobs stage simulator setting theatre worker_process worker batch executors
    statistics tally stopping results recorder learning progress session
    summary interrupts replays listings
    testing.scripts testing.ego_checks testing.agent_checks testing.assertion_checks testing
    commands commands.run commands.replay commands.merge commands.inspect commands.import_osm
    commands.check_ego commands.game
    cli_settings cli_egos cli_networks cli_games cli __main__
""".split()

HEAVY = {"numpy", "pandas", "scipy", "shapely", "libsumo", "sumolib", "pydantic", "rich"}
HEAVY |= {"matplotlib", "osmium", "pyproj", "sumo"}


def short(name: str) -> str:
    """The name of a module within the package."""
    return name.removeprefix("cavsumo.")


def sources() -> dict[str, Path]:
    """Every module of the package with its file."""
    found = {}
    for file in sorted(PACKAGE.rglob("*.py")):
        parts = file.relative_to(PACKAGE.parent).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        found[short(name)] = file
    return found


SOURCES = sources()


def imported(file: Path) -> Iterator[str]:
    """The full names of all modules that a file imports, inside functions too."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file.name}: relative import"
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                yield whole if short(whole) in SOURCES else str(node.module)


def loaded_by(module: str) -> set[str]:
    """The packages that a fresh Python has loaded after importing a module."""
    code = f"import sys, {module}; print(*{{name.split('.')[0] for name in sys.modules}})"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
    )
    return set(done.stdout.split())


def test_every_module_has_its_place() -> None:
    """A new module is given its place in the order, and a module that is gone leaves it."""
    assert sorted(ORDER) == sorted(SOURCES)


@pytest.mark.parametrize("module", sorted(SOURCES))
def test_a_module_uses_only_what_stands_before_it(module: str) -> None:
    """Imports point one way, so each part can be read, tested and replaced by itself."""
    place = {name: i for i, name in enumerate(ORDER)}
    for name in imported(SOURCES[module]):
        # A package stands behind its files, which it imports; a file may come from its package.
        if name.split(".")[0] == "cavsumo":
            assert place[short(name)] < place[module], f"{module} uses {short(name)}"


def test_only_the_world_imports_sumo() -> None:
    """The boundary to SUMO is one file; nobody else imports libsumo or traci, even lazily."""
    users = {
        module: {"libsumo", "traci"} & {name.split(".")[0] for name in imported(file)}
        for module, file in SOURCES.items()
    }
    assert {module: found for module, found in users.items() if found} == {"world": {"libsumo"}}


def test_the_command_line_starts_light() -> None:
    """Help and mistakes are answered at once: nothing heavy is loaded before a command runs."""
    assert not HEAVY & loaded_by("cavsumo.cli")


def test_the_process_that_waits_has_no_sumo() -> None:
    """SUMO may take its process down, so the parent, which keeps the results, never loads it."""
    assert "libsumo" not in loaded_by("cavsumo.session, cavsumo.commands.run")
