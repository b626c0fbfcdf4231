"""Scripts of experiments/, played once at their smallest size."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path
from types import ModuleType

import pytest
from inline import cavsumo
from support import ROOT

pytestmark = pytest.mark.usefixtures("inline")
NET = str(ROOT / "networks" / "pedestrians.net.xml")
STUDY = f"""
net = "{NET}"
routes = "none"
agents = ["programmed-random", "nearest=election"]
runs = 2
end = 5
trace = "none"

[[vary.place]]
name = "straight"
ego = "constant"

[vary]
testers = [1, 3]
"""


def script(name: str) -> ModuleType:
    """A module of experiments/, which is no package."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "experiments" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(("name", "tables"), [("tables", 4), ("games", 1)])
def test_the_tables_of_the_experiments(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, tables: int
) -> None:
    """Of a study of four episodes, on a page of its own."""
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    words = ["run", "-c", "study.toml", "-o", "small.csv", "-q", "--exit-zero"]
    assert cavsumo(tmp_path, *words).returncode == 0
    monkeypatch.syspath_prepend(str(ROOT / "experiments"))
    sys.modules.pop("tables", None)
    module = script(name)
    where = sys.modules.get("tables", module)
    written: dict[str, list[str]] = {}
    monkeypatch.setattr(
        module, "write_tables", lambda found: written.update({k: [*v] for k, v in found.items()})
    )
    (tmp_path / "peers.csv").write_bytes((ROOT / "experiments" / "peers.csv").read_bytes())
    monkeypatch.setattr(where, "HERE", tmp_path)
    files = [str(tmp_path / f"small-straight-testers{n}.csv") for n in (1, 3)]
    monkeypatch.setattr(sys, "argv", [name, *files])
    module.main()
    sys.modules.pop("tables", None)
    assert len(written) == tables
    assert len(written["rates" if name == "tables" else "games"]) == 2 + 2 * (1 + (name == "games"))
    assert (tmp_path / "agency.csv").is_file() == (name == "tables")


@pytest.mark.parametrize(
    ("drivers", "driver"),
    [("faulty_drivers", "SeesTheNearestOnly"), ("other_drivers", "YieldsToOne")],
)
def test_scores_against_faulty_drivers(
    drivers: str,
    driver: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    """One driver, ten episodes of a search and of timing; the table once more from the file."""
    monkeypatch.syspath_prepend(str(ROOT / "experiments" / "search"))
    monkeypatch.setenv("PYTHONPATH", "")
    file = str(tmp_path / "trials.jsonl")
    words = ["--drivers", drivers, "--driver", driver, "--seed", "1", "--episodes", "10", "-j", "1"]
    monkeypatch.setattr(sys, "argv", ["score.py", *words, "--net", "pedestrians", "-o", file])
    script("search/score").main()
    table = capsys.readouterr().out
    first, *_, last = table.splitlines()
    assert first.split() == ["driver", "portfolio", "timing"]
    assert last.startswith("timing: a faulty driver failed in ")
    assert " of 1 trials" in last
    trials = [json.loads(line) for line in Path(file).read_text(encoding="utf-8").splitlines()]
    assert [(t["driver"], t["testers"]) for t in trials] == [(driver, 2)] * 2
    monkeypatch.setattr(sys, "argv", ["score.py", "--read", file])
    script("search/score").main()
    assert capsys.readouterr().out == table
