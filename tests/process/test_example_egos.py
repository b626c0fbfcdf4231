"""The example egos: as a program, as a server and in C they drive alike and pass the checks."""

from __future__ import annotations

import dataclasses
import importlib.util
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from support import ROOT, rows, serving, traces

from cavsumo.cli import main
from cavsumo.testing import ego_checks

pytestmark = pytest.mark.usefixtures("inline")
EXAMPLES = ROOT / "examples" / "egos"
CAREFUL = EXAMPLES / "stop_for_pedestrians.py"


def run(net: Path, ego: str, *words: str, output: str = "r.csv") -> int:
    """``cavsumo run`` with that ego, quietly."""
    return main(["run", "-n", str(net), "--ego", ego, "-q", "-o", output, *words])


# The same controller in every form ----------------------------------------------------------------

WRAPPED = """
import importlib.util
from cavsumo.egos import Acceleration

spec = importlib.util.spec_from_file_location("careful", {file!r})
careful = importlib.util.module_from_spec(spec)
spec.loader.exec_module(careful)
STATES = {{"r": "red", "y": "yellow", "u": "red-yellow", "g": "green", "G": "green"}}

class Careful:
    def reset(self, scene):
        kind = scene.ego.kind
        self.scene, self.path = scene, careful.Path(scene.ego_path.points)
        limits = kind.throttle_min, kind.throttle_max
        self.constants = (scene.dt, kind.length, kind.width, *limits)

    def act(self, snapshot):
        ego, along = snapshot.ego, self.scene.ego_progress(snapshot)
        front = along + ego.body.kind.length / 2
        lights = zip(self.scene.lights, snapshot.lights)
        ahead = [(t.along - front, STATES[s]) for t, s in lights if t.along >= front]
        bodies = [
            (b.body.kind.name, b.x, b.y, b.o, b.v, b.body.kind.length, b.body.kind.width)
            for b in (*snapshot.testers, *snapshot.background)
        ]
        return Acceleration(careful.acceleration(
            self.path, self.constants, ego.v, along, ego.x, ego.y,
            ahead[0] if ahead else None, bodies,
        ))
"""


@pytest.fixture(scope="module")
def careful() -> ModuleType:
    """The Python example as a module."""
    spec = importlib.util.spec_from_file_location("careful", CAREFUL)
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_controller_gives_the_same_rows_in_every_form(
    networks: dict[str, Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    controller: Callable[..., str],
) -> None:
    """As a class here, as a process, as a server, one or two at a time: rows and traces agree."""
    monkeypatch.chdir(tmp_path)
    name = controller(WRAPPED.format(file=str(CAREFUL)))
    words = "--agent timing --runs 2 --end 12 --trace all".split()
    with serving(CAREFUL) as spec:
        forms = {f"{name}:Careful": "1", f"exec:{sys.executable} {CAREFUL}": "2", spec: "2"}
        for i, (ego, jobs) in enumerate(forms.items()):
            done = run(networks["crossing"], ego, *words, "-j", jobs, output=f"r{i}.csv")
            assert done in (0, 1)
    found = [
        [{k: v for k, v in row.items() if k not in ("ego", "trace")} for row in rows(file)]
        for file in (tmp_path / f"r{i}.csv" for i in range(3))
    ]
    assert found[0] == found[1] == found[2]
    assert {row["outcome"] for row in found[0]} - {"error"}
    frames = [
        {n: text.splitlines()[1:] for n, text in traces(tmp_path / f"r{i}.csv").items()}
        for i in range(3)
    ]
    assert frames[0] == frames[1] == frames[2]
    assert len(frames[0]) == 2


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The C example, compiled."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        pytest.skip("there is no C compiler here")
    program = tmp_path_factory.mktemp("c") / "stop_for_pedestrians"
    source = EXAMPLES / "stop_for_pedestrians.c"
    line = [compiler, "-O2", "-Wall", "-Wextra", "-Werror", "-o", str(program), str(source), "-lm"]
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return program


def test_the_example_in_c_drives_like_the_one_in_python(
    compiled: Path, networks: dict[str, Path], tmp_path: Path
) -> None:
    """The same outcomes on a busy junction, and nearly the same times."""
    words = "--agent timing --runs 2 --end 12 --trace none".split()
    for name, ego in (("c", compiled), ("p", f"{sys.executable} {CAREFUL}")):
        output = str(tmp_path / f"{name}.csv")
        assert run(networks["crossing"], f"exec:{ego}", *words, output=output) in (0, 1)
    in_c, in_python = rows(tmp_path / "c.csv"), rows(tmp_path / "p.csv")
    assert [row["outcome"] for row in in_c] == [row["outcome"] for row in in_python]
    assert "error" not in {row["outcome"] for row in in_c}
    for one, other in zip(in_c, in_python, strict=True):
        assert float(one["time_s"]) == pytest.approx(float(other["time_s"]), abs=1.0)


@pytest.mark.parametrize("x", [18.0, 25.0, 45.0])
def test_the_examples_brake_for_who_is_ahead_and_for_nobody_else(
    careful: ModuleType, x: float
) -> None:
    """At 8 m/s with somebody on the lane, walking onto it, beside it, behind; a red light."""
    path, constants = careful.Path([(0.0, 0.0), (100.0, 0.0)]), (0.1, 4.5, 1.75, -9.0, 9.0)

    def decided(*bodies: tuple[Any, ...], light: Any = None) -> float:
        told = path, constants, 8.0, 10.0, 10.0, 0.0, light, bodies
        answer: float = careful.acceleration(*told)
        return answer

    def walker(y: float, heading: float, speed: float) -> tuple[Any, ...]:
        return ("pedestrian", x, y, heading, speed, 0.66, 0.88)

    free = decided()
    assert free == pytest.approx(1.5)
    assert decided(walker(0.0, 1.57, 0.0)) <= decided(walker(2.5, -1.57, 1.4)) + 1e-9
    assert decided(walker(0.0, 1.57, 0.0)) < free if x < 40.0 else free
    assert decided(walker(3.0, 1.57, 1.4)) == decided(walker(3.0, 0.0, 1.4)) == free
    assert decided(("pedestrian", 4.0, 0.0, 0.0, 0.0, 0.66, 0.88)) == free
    assert decided(light=(x - 12.0, "green")) == free
    assert decided(light=(8.0, "red")) == -9.0
    assert decided(light=(1.0, "red")) == free, "too late to stop before it"


@pytest.fixture(params=["program", "server", "program in C"])
def example(request: pytest.FixtureRequest) -> Iterator[str]:
    """The example in each of its forms; its spec."""
    if request.param == "server":
        with serving(CAREFUL) as spec:
            yield spec
    elif request.param == "program":
        yield f"exec:{sys.executable} {CAREFUL}"
    else:
        yield f"exec:{request.getfixturevalue('compiled')}"


def test_the_examples_pass_the_checks(
    example: str,
    networks: dict[str, Path],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """``cavsumo check-ego`` passes each of them; its long episode is a short one here."""
    short = dataclasses.replace(ego_checks.LONG, steps=600)
    monkeypatch.setattr(ego_checks, "LONG", short)
    assert main(["check-ego", example, "-n", str(networks["crossing"])]) == 0
    said = capsys.readouterr().out
    assert "600 answers" in said
    assert "8 checks of ego" in said
