"""Modules of version 0.1 by their old names: the same modules as by their new ones."""

from __future__ import annotations

import importlib
import subprocess
import sys

import pytest

import cavsumo

MOVED = {
    "cavsumo.bodies": "cavsumo.model.bodies",
    "cavsumo.checks": "cavsumo.model.checks",
    "cavsumo.commands": "cavsumo.cli.commands",
    "cavsumo.commands.run": "cavsumo.cli.commands.run",
    "cavsumo.contacts": "cavsumo.assertions.contacts",
    "cavsumo.ego_observations": "cavsumo.envs.ego_observations",
    "cavsumo.ego_rewards": "cavsumo.envs.ego_rewards",
    "cavsumo.executors": "cavsumo.batch.executors",
    "cavsumo.formulas": "cavsumo.assertions.formulas",
    "cavsumo.formulas.syntax": "cavsumo.assertions.formulas.syntax",
    "cavsumo.kinematics": "cavsumo.model.kinematics",
    "cavsumo.metrics": "cavsumo.assertions.metrics",
    "cavsumo.metrics.plane": "cavsumo.assertions.metrics.plane",
    "cavsumo.observations": "cavsumo.agents.observations",
    "cavsumo.policies": "cavsumo.agents.policy_file",
    "cavsumo.rewards": "cavsumo.simulation.rewards",
    "cavsumo.roads": "cavsumo.model.carriageway",
    "cavsumo.scene": "cavsumo.model.scene",
    "cavsumo.sensors": "cavsumo.model.sensors",
    "cavsumo.snapshot": "cavsumo.model.snapshot",
    "cavsumo.statistics": "cavsumo.results.statistics",
}


def test_every_moved_module_is_listed_here() -> None:
    """The old names at the root are those of this test."""
    assert {f"cavsumo.{name}" for name in cavsumo._MOVED} == {
        name for name in MOVED if name.count(".") == 1
    }


@pytest.mark.parametrize("old", sorted(MOVED))
def test_an_old_name_is_the_same_module(old: str) -> None:
    """One module object, which knows itself by its new name."""
    module = importlib.import_module(old)
    assert module is importlib.import_module(MOVED[old])
    assert module.__name__ == MOVED[old]
    assert module.__spec__ is not None
    assert module.__spec__.name == MOVED[old]


@pytest.mark.parametrize("old_first", [True, False], ids=["old first", "new first"])
def test_the_order_of_imports_does_not_matter(old_first: bool) -> None:
    """In a fresh process, by either name first."""
    pairs = [pair if old_first else pair[::-1] for pair in MOVED.items()]
    lines = [f"import {one}, {other}; assert {one} is {other}" for one, other in pairs]
    _play("\n".join(lines))


@pytest.mark.parametrize(
    "statement",
    [
        "import cavsumo.kinematics; cavsumo.kinematics.step",
        "import cavsumo.kinematics as kinematics; kinematics.step",
        "from cavsumo import kinematics, metrics; metrics.rss_longitudinal, kinematics.step",
        "from cavsumo.metrics import rss_longitudinal",
        "from cavsumo.metrics.plane import ttc_boxes",
        "from cavsumo.policies import Header, Observed, Policy",
        "from cavsumo.roads import Start, Approach",
        "from cavsumo.results import read_rows",
        "from cavsumo.commands.run import Manner, run",
    ],
)
def test_statements_of_users(statement: str) -> None:
    """Every way to write an import."""
    exec(statement, {})


def test_another_name_is_still_unknown() -> None:
    """What was never there is not found, nor what was not for users."""
    for name in ("cavsumo.nothing", "cavsumo.metrics.nothing", "cavsumo.worker_process"):
        with pytest.raises(ModuleNotFoundError, match=name.rpartition(".")[2]):
            importlib.import_module(name)


def test_the_package_itself_loads_nothing() -> None:
    """``import cavsumo`` is free: neither numpy nor SUMO, and no room."""
    _play(
        "import sys, cavsumo\n"
        "heavy = {'numpy', 'libsumo', 'pydantic', 'scipy', 'shapely', 'pandas'}\n"
        "assert not heavy & set(sys.modules)\n"
        "assert not [name for name in sys.modules if name.startswith('cavsumo.')]"
    )


def _play(code: str) -> None:
    """Run statements in a fresh process."""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 0, done.stderr
