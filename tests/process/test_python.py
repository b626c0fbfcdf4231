"""The Python interface: the rows of the command, as tables, pages and words."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from support import rows, traces

import cavsumo
from cavsumo import Results
from cavsumo.batch.worker import close_all
from cavsumo.cli import main

WORDS = "-n crossing --agent timing --agent proximity --runs 5 --seed 3 --trace all -q --exit-zero"
BATCH = {"agents": ["timing", "proximity"], "runs": 5, "seed": 3, "trace": "all"}


@pytest.fixture(scope="module")
def by_command(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A batch of the command's, with tests and failures."""
    file = tmp_path_factory.mktemp("command") / "results.csv"
    assert main(["run", *WORDS.split(), "-j", "2", "-o", str(file)]) == 0
    return file


@pytest.fixture(scope="module")
def results() -> Results:
    """The same batch from Python."""
    return cavsumo.run("crossing", **BATCH)


def test_importing_cavsumo_loads_nothing_heavy() -> None:
    """Neither numpy nor libsumo nor pandas, until a name is used; the names are listed."""
    heavy = "{'numpy', 'libsumo', 'pandas', 'pydantic', 'rich', 'cloudpickle'}"
    code = (
        f"import sys, cavsumo; found = {heavy} & set(sys.modules); assert not found, found\n"
        "assert set(cavsumo.__all__) <= set(dir(cavsumo))\n"
        "cavsumo.InputError; assert 'numpy' not in sys.modules\n"
        "from cavsumo import *; run, load, Scenario\n"
        "assert 'libsumo' not in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr


def test_a_name_that_is_not_public_is_no_attribute() -> None:
    """As in any module."""
    with pytest.raises(AttributeError, match="no attribute 'ran'"):
        _ = cavsumo.ran  # type: ignore[attr-defined]


def test_the_rows_and_traces_are_those_of_the_command(results: Results, by_command: Path) -> None:
    """Byte for byte, but for the real time, with one process as with two."""
    assert rows(results.file) == rows(by_command)
    assert traces(results.file) == traces(by_command)


def test_a_scenario_file_and_an_output_are_taken(by_command: Path, tmp_path: Path) -> None:
    """The keywords win over the file; the results lie where they were wanted, and are loaded."""
    config = tmp_path / "scenario.toml"
    config.write_text('agents = ["timing", "proximity"]\nruns = 9\nseed = 3\ntrace = "all"\n')
    output = tmp_path / "out.csv"
    with ThreadPoolExecutor(2) as executor:
        played = cavsumo.run(config=config, output=output, runs=2, executor=executor)
    close_all()
    assert played.file == output
    first = rows(by_command)[:4]
    for row in first:
        row["trace"] = row["trace"].replace("results/", "out/")
    assert rows(output) == first
    assert (tmp_path / "out.json").is_file()
    assert cavsumo.load(output).rows.equals(played.rows)
