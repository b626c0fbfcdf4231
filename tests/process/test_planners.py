"""The planners of examples/planners, where their packages are installed in this environment."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest
from support import ROOT, rows

from cavsumo.cli import main

PLANNERS = ROOT / "examples" / "planners"
PACKAGES = {
    "fiss.py fop": "fiss_planner",
    "fiss.py fop_plus": "fiss_planner",
    "fiss.py fiss": "fiss_planner",
    "fiss.py fiss_plus": "fiss_planner",
    "frenet.py": "frenetix",
    "highway.py": "highway_env",
    "reactive.py": "commonroad_rp",
}
PIP = {
    "fiss_planner": "fiss-planner==1.0.0",
    "frenetix": "frenetix==0.4.0",
    "highway_env": "highway-env==1.12.1",
    "commonroad_rp": "commonroad-reactive-planner==2025.1",
}
pytestmark = pytest.mark.usefixtures("inline")


def run(command: str, output: Path, *words: str) -> int:
    """``cavsumo run`` on the straight road with a planner."""
    ego = f"exec:{sys.executable} {PLANNERS / command}"
    limits = "--ego-param", "reply_s=60", "--ego-param", "start_s=60"
    where = "-n", str(ROOT / "networks" / "pedestrians.net.xml"), "-o", str(output), "-q"
    return main(["run", *where, "--ego", ego, *limits, *words])


@pytest.mark.slow
@pytest.mark.parametrize("command", PACKAGES)
def test_a_real_planner_arrives(command: str, tmp_path: Path) -> None:
    """On an empty road, near the speed limit; an answer out of range would be an error row."""
    if importlib.util.find_spec(PACKAGES[command]) is None:
        pytest.skip(f"needs pip install {PIP[PACKAGES[command]]}")
    file = tmp_path / "r.csv"
    assert run(command, file, "--agent", "noop", "--runs", "1") == 0
    (row,) = rows(file)
    assert (row["outcome"], row["arrived"]) == ("not_triggered", "1")
    assert float(row["lost_s"]) < 3.0


@pytest.mark.parametrize("command", ["fiss.py", "frenet.py", "highway.py", "reactive.py"])
def test_a_planner_without_its_package_is_refused(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In one sentence with the command that installs it; nothing is written."""
    package = next(name for words, name in PACKAGES.items() if words.startswith(command))
    if importlib.util.find_spec(package) is not None:
        pytest.skip("it is installed")
    assert run(command, tmp_path / "r.csv", "--runs", "1") == 2
    assert f"needs a package: pip install {PIP[package]}" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
