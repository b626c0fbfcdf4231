"""``cavsumo check-ego`` passes every correct ego: the built-in ones and those of the docs."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from support import ROOT

from cavsumo.cli.command_line import main
from cavsumo.egos import EGOS, Acceleration, Command, Ego
from cavsumo.egos.base import EGO_KIND
from cavsumo.model.snapshot import Snapshot
from cavsumo.testing import ego_checks
from cavsumo.testing.scripts import EMPTY, drive, ground

BLOCK = re.compile(r"```python\n(.*?)```", re.DOTALL)


def documented() -> dict[str, str]:
    """The egos that README and docs show as a module: the name of the class and the source."""
    found = {}
    for file in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))):
        for source in BLOCK.findall(file.read_text(encoding="utf-8")):
            for name in re.findall(r"^class (\w+)[^\n]*:\n", source, re.MULTILINE):
                if "def act(self, snapshot):" in source and "from cavsumo" in source:
                    found[name] = source
    return found


DOCUMENTED = documented()


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


def test_check_ego_says_what_passes_and_what_does_not(
    networks: dict[str, Path], controller: Callable[..., str], capsys: pytest.CaptureFixture[str]
) -> None:
    """A line for each check, with the time and the number where it failed; exit status 0, 1, 2."""
    name = controller(
        "import time\nfrom cavsumo.egos import Acceleration\n"
        "class Calm:\n"
        "    def act(self, snapshot):\n"
        "        return Acceleration(max(-3.0, min(2.0, 8.0 - snapshot.ego.v)))\n"
        "class Late(Calm):\n"
        "    def act(self, snapshot):\n"
        "        return Acceleration(12.0) if snapshot.time > 2 else super().act(snapshot)\n"
        "class Stuck(Calm):\n"
        "    def act(self, snapshot):\n"
        "        while snapshot.time > 400: time.sleep(0.1)\n"
        "        return super().act(snapshot)\n"
    )
    on = ["-n", str(networks["pedestrians"])]
    assert main(["check-ego", f"{name}:Calm", *on]) == 0
    said = capsys.readouterr().out
    assert said.count("ok    ") == len(ego_checks.CHECKS) + 1
    assert "all passed" in said
    assert main(["check-ego", f"{name}:Late", *on]) == 1
    said = capsys.readouterr().out
    assert "FAIL  empty road" in said
    assert "at 2.10 s: value must lie in [-9, 9], got 12.0" in said
    assert "FAIL  in SUMO" in said
    assert main(["check-ego", f"{name}:Stuck", *on, "--deadline", "2"]) == 1
    failed = [line for line in capsys.readouterr().out.splitlines() if "FAIL" in line]
    assert [line[6:18] for line in failed] == ["long episode"]
    assert failed[0].endswith("not done within 2 s")
    assert main(["check-ego", f"{name}:Clam", *on]) == 2
    assert "did you mean 'Calm'?" in capsys.readouterr().err
