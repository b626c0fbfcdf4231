"""The wheel, unpacked: the networks that have names are in it and are played anywhere."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from support import ROOT, content


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, unpacked as pip does it."""
    pytest.importorskip("hatchling")
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)],
        cwd=ROOT, capture_output=True, timeout=120, check=True,
    )  # fmt: skip
    with zipfile.ZipFile(next(folder.glob("*.whl"))) as wheel:
        wheel.extractall(folder / "site")
    return folder / "site"


def test_the_wheel_has_the_networks_and_no_other_copy(unpacked: Path) -> None:
    """Every network and its demand, with their notice, the same bytes; no Python among them."""
    packed = content(unpacked / "cavsumo" / "data")
    files = [ROOT / "networks" / "README.md"]
    files += [*ROOT.glob("networks/*.net.xml"), *ROOT.glob("routes/*.rou.xml")]
    assert packed == {str(f.relative_to(ROOT)): f.read_bytes() for f in files}
    assert not (ROOT / "cavsumo" / "data").exists()


def test_an_installed_cavsumo_plays_without_options(unpacked: Path, tmp_path: Path) -> None:
    """``cavsumo run`` plays the crossing of the package, anywhere."""
    words = [sys.executable, "-m", "cavsumo", "run", "--runs", "1", "--exit-zero"]
    done = subprocess.run(
        words, cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(unpacked)},
        capture_output=True, text=True, timeout=200,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "network crossing junction 4435014132, traffic crossing.rou.xml" in done.stderr
    plan = json.loads((tmp_path / "results.json").read_text())["plan"]
    assert plan["scenario"]["net"] == "crossing"


def test_the_wheels_own_networks_are_meant(unpacked: Path, tmp_path: Path) -> None:
    """A name leads into the package that is imported."""
    code = (
        "import cavsumo.model.named_networks as n; from pathlib import Path; "
        "print(n.network_file(Path('junction'))); print(n.routes_file(n.routes_of('junction')))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(unpacked)},
        capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    data = unpacked / "cavsumo" / "data"
    net, routes = data / "networks" / "junction.net.xml", data / "routes" / "junction.rou.xml"
    assert done.stdout.split() == [str(net), str(routes)]
