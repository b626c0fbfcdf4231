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
    cavsumo errors checks registry imports processes
    games.compiled games.compiled.graphs games.compiled.systems
    games.model games.build games.files games.readings games.segments games.advantages games.regions
    games.components games.solvable games.policies games.chains games.evaluation games.proper
    games.certificate games.flow games.arena games.compiled.bellman games.backups
    games.matrix_games games.pairs games.reach games.plays games.turn_based games.simultaneous
    games.approach games.solve games games.drawing games.pictures
    kinematics geometry paths bodies snapshot fairness roads sumo_poses background
    metrics.following metrics.rss metrics.highway_code metrics.zones metrics.plane
    metrics.encroachment metrics
    network ego_routes lane_chains approaches starts vehicle_starts kerbs signals trips traffic
    route_rules scene site sight sensors
    osm handedness netconvert facts surfaces inspection layers picture
    abstraction.coordinates abstraction.classes abstraction.rules abstraction.lattice
    abstraction.solved abstraction.outlook abstraction.opponent abstraction.response
    abstraction.solving abstraction
    agents.base agents.walking agents.driving agents.triggers agents.random agents.features
    agents.manoeuvres agents.behaviours agents.programmed agents.election agents.qlearning
    agents.tactics agents.rehearsal agents.expectiminimax agents.best_response agents.recorded
    agents
    observations policies agents.policy
    ego_observations
    contacts conduct criticality
    formulas.nodes formulas.words formulas.syntax formulas.windows formulas.semantics
    formulas.signals formulas.rules formulas
    assertions.base assertions.room assertions.collision assertions.reaction_zone
    assertions.margin assertions.relations assertions.stopping_distance assertions.two_second_gap
    assertions.speed_limit assertions.leaving_the_road assertions.red_light assertions.give_way
    assertions.reasons assertions.standing assertions.hard_braking assertions.rss
    assertions.criticality assertions.formula assertions.custom assertions.specs assertions
    validity blame
    references.encounter references.base references.ideal references.human references.rss references
    egos.base egos.takeover egos.constant egos.sumo egos.time_gap egos.effectors egos.controller
    egos.protocol egos.link egos.child egos.wire egos.external egos.specs egos
    options labels scenario config study outcomes rewards ego_rewards
    sumo_types demand simulations world
    foresight jobs stage simulator counterfactual setting traces theatre worker_process worker batch
    executors
    envs.spaces envs.puppets envs.settings envs.events envs.episodes envs.elsewhere_process
    envs.elsewhere envs.painting envs.base envs.tester envs.ego envs.parallel envs.discrete envs
    statistics tally stopping results recorder learning progress session checked
    summary interrupts replays seeds subjects opponents certificate listings fcd gui
    pages.shell pages player.packing player.curves player.scenery player.facts player.page player
    report report.load report.grouping report.rates report.pairs report.compare report.survival
    report.effort report.events report.distinct report.analysis report.cells report.tables
    report.figures report.formats report.junit
    report.page.scenes report.page.words report.page.plots report.page.places report.page.links
    report.page.document report.page
    testing.scripts testing.ego_checks testing.agent_checks testing.assertion_checks
    testing.contracts testing
    commands commands.run commands.replay commands.merge commands.report commands.inspect
    commands.import_osm commands.check_ego commands.game commands.certify
    cli_settings cli_egos cli_networks cli_results cli_games cli_certify
    cli __main__
""".split()

HEAVY = {"numpy", "pandas", "scipy", "shapely", "libsumo", "sumolib", "pydantic", "rich"}
HEAVY |= {"matplotlib", "osmium", "pyproj", "sumo", "jinja2", "traci"}


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
    """The boundary to SUMO is one file; nobody else simulates, even lazily."""
    users = {
        module: {"libsumo", "traci"} & {name.split(".")[0] for name in imported(file)}
        for module, file in SOURCES.items()
    }
    found = {module: names for module, names in users.items() if names}
    assert found == {"world": {"libsumo"}, "gui": {"traci"}}  # the latter only shows


def test_the_command_line_starts_light() -> None:
    """Help and mistakes are answered at once: nothing heavy is loaded before a command runs."""
    assert not HEAVY & loaded_by("cavsumo.cli")


def test_the_process_that_waits_has_no_sumo() -> None:
    """SUMO may take its process down, so the parent, which keeps the results, never loads it."""
    assert "libsumo" not in loaded_by("cavsumo.session, cavsumo.commands.run")


def test_an_ego_is_checked_without_pytest() -> None:
    """Who installs cavsumo alone has the command too."""
    assert "pytest" not in loaded_by("cavsumo.commands.check_ego")
