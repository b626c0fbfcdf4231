"""``cavsumo check-ego`` passes every correct ego: the built-in ones, the examples, the docs'."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from support import ROOT, serving

from cavsumo.cli.command_line import main
from cavsumo.egos import EGOS, Acceleration, Command, Ego
from cavsumo.egos.base import EGO_KIND
from cavsumo.model.snapshot import Snapshot
from cavsumo.testing import ego_checks
from cavsumo.testing.scripts import EMPTY, drive, ground

EXAMPLES = ROOT / "examples" / "egos"
PYTHON_EXAMPLE = EXAMPLES / "stop_for_pedestrians.py"
BLOCK = re.compile(r"```python\n(.*?)```", re.DOTALL)


def documented() -> dict[str, str]:
    """The egos that README and docs show: the name of the class and the source of its module."""
    found = {}
    for file in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))):
        for source in BLOCK.findall(file.read_text(encoding="utf-8")):
            for name in re.findall(r"^class (\w+)[^\n]*:\n", source, re.MULTILINE):
                if "def act(self, snapshot):" in source:
                    found[name] = source
    return found


DOCUMENTED = documented()


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    """The Python example as a server; its spec."""
    with serving(PYTHON_EXAMPLE) as spec:
        yield spec


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The C example, compiled."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        pytest.skip("there is no C compiler here")
    program = tmp_path_factory.mktemp("c") / "stop_for_pedestrians"
    source = EXAMPLES / "stop_for_pedestrians.c"
    subprocess.run([compiler, "-O2", "-o", str(program), str(source), "-lm"], check=True)
    return program


def passes(ego: str, net: Path, capsys: pytest.CaptureFixture[str]) -> bool:
    """Whether the command passes an ego; what it said is shown when it does not."""
    status = main(["check-ego", ego, "-n", str(net)])
    said = capsys.readouterr().out
    assert "FAIL" not in said, said
    return status == 0


@pytest.mark.parametrize("name", list(EGOS))
def test_the_built_in_egos_pass(
    networks: dict[str, Path], capsys: pytest.CaptureFixture[str], name: str
) -> None:
    """On the network of the README, traffic as it comes."""
    assert passes(name, networks["crossing"], capsys)


def test_the_docs_show_three_egos() -> None:
    """README's, docs/architecture.md's and docs/observations.md's."""
    assert {"Brake", "Keeper", "Gentle"} <= set(DOCUMENTED)


@pytest.mark.parametrize("name", sorted(DOCUMENTED))
def test_the_egos_of_the_docs_pass(
    networks: dict[str, Path],
    controller: Callable[..., str],
    capsys: pytest.CaptureFixture[str],
    name: str,
) -> None:
    """README's Brake stops for anybody near its lane, pedestrians on the pavement included."""
    module = controller(DOCUMENTED[name])
    assert passes(f"{module}:{name}", networks["crossing"], capsys)


def test_the_example_in_python_passes(
    networks: dict[str, Path], capsys: pytest.CaptureFixture[str], server: str
) -> None:
    """As a program and as a server."""
    for ego in (f"exec:{sys.executable} {PYTHON_EXAMPLE}", server):
        assert passes(ego, networks["crossing"], capsys)


def test_the_example_in_c_passes(
    networks: dict[str, Path], capsys: pytest.CaptureFixture[str], compiled: Path
) -> None:
    """As a program."""
    assert passes(f"exec:{compiled}", networks["crossing"], capsys)


class Shy(Ego):
    """Stands while anybody is in sight or a light is not green."""

    def act(self, snapshot: Snapshot) -> Command:
        alone = not snapshot.testers and not snapshot.raw_background
        free = alone and set(snapshot.lights) <= set("Gg")
        return Acceleration(max(-3.0, min(2.0, (8.0 if free else 0.0) - snapshot.ego.v)))


@pytest.mark.parametrize("name", ["pedestrians", "crossing", "junction"])
def test_the_empty_road_is_empty(networks: dict[str, Path], name: str) -> None:
    """No testers, no traffic, no red light: not even the shyest ego has a reason to stand."""
    here = ground(networks[name], EGO_KIND)
    assert ego_checks.check_empty_road(Shy, here)
    for snapshot, _ in drive(Shy(), here, EMPTY, 1):
        assert snapshot.testers == ()
        assert snapshot.raw_background == ()
        assert set(snapshot.lights) <= {"G"}
