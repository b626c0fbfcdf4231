"""What an import loads, in a fresh Python."""

from __future__ import annotations

import subprocess
import sys

HEAVY = {"numpy", "pandas", "scipy", "shapely", "libsumo", "sumolib", "pydantic", "rich"}
HEAVY |= {"matplotlib", "osmium", "pyproj", "sumo", "jinja2", "traci"}


def loaded_by(module: str) -> set[str]:
    """The packages that a fresh Python has loaded after importing modules."""
    code = f"import sys, {module}; print(*{{name.split('.')[0] for name in sys.modules}})"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
    )
    return set(done.stdout.split())


def test_the_command_line_starts_light() -> None:
    """Help and mistakes are answered at once: nothing heavy is loaded before a command runs."""
    assert not HEAVY & loaded_by("cavsumo.cli")


def test_the_process_that_waits_has_no_sumo() -> None:
    """SUMO may take its process down, so the parent, which keeps the results, never loads it."""
    assert "libsumo" not in loaded_by("cavsumo.batch.playing, cavsumo.cli.commands.run")


def test_a_process_that_plays_starts_without_scipy() -> None:
    """Each batch starts some: what only summaries and games need is not loaded."""
    player = "cavsumo.batch.worker_process, cavsumo.batch.episode_server"
    assert "scipy" not in loaded_by(f"{player}, cavsumo.batch.episode_runner")


def test_the_plugin_of_pytest_is_light() -> None:
    """Pytest loads it wherever cavsumo is installed."""
    assert not HEAVY & loaded_by("cavsumo.kept.pytest_plugin")


def test_an_ego_is_checked_without_pytest() -> None:
    """Who installs cavsumo alone has the command too."""
    assert "pytest" not in loaded_by("cavsumo.cli.commands.check_ego")
