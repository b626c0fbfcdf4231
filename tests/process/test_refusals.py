"""A refused command is quick: it answers before numpy, scipy, shapely or libsumo are imported."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from cavsumo.results.columns import COLUMNS
from cavsumo.results.reading import FORMAT

HEAVY = ("numpy", "scipy", "shapely", "libsumo", "pandas", "sumolib", "matplotlib", "gymnasium")

# One process goes through all of them: what one of them imports stays imported.
PROGRAM = """
import contextlib, io, json, sys
from cavsumo.cli import main

found = []
for words in json.load(sys.stdin):
    said = io.StringIO()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(said):
        try:
            status = main(words)
        except SystemExit as exit:
            status = exit.code
    loaded = {name.partition(".")[0] for name in sys.modules}
    found.append([status, said.getvalue(), sorted(loaded)])
json.dump(found, sys.stdout)
"""
REFUSED = {
    "rnu": "unknown command 'rnu'; did you mean 'run'?",
    "--verson": "unknown option '--verson'; did you mean '--version'?",
    "run --trase all": "run: unknown option '--trase'; did you mean '--trace'?",
    "run --agnt=timing": "unknown option '--agnt'; did you mean '--agent'?",
    "certify old.csv 0 --run 9": "unknown option '--run'; did you mean '--runs'?",
    "replay old.csv 0 --playbac": "unknown option '--playbac'; did you mean '--playback'?",
    "report old.csv --htm a.html": "unknown option '--htm'; did you mean '--html'?",
    "merge old.csv --ouput whole.csv": "unknown option '--ouput'; did you mean '--output'?",
    "inspect crossing --pictre a.png": "unknown option '--pictre'; did you mean '--picture'?",
    "import-osm town.osm --outptu a.net.xml": "did you mean '--output'?",
    "game solve old.json --reeding C": "game solve: unknown option '--reeding'; did you mean",
    "check-ego sumo --nte crossing": "unknown option '--nte'; did you mean '--net'?",
    "agents --hlp": "agents: unknown option '--hlp'; did you mean '--help'?",
    "run --runs many": "--runs: invalid int value: 'many'",
    "run --runs 0": "runs: Input should be greater than or equal to 1, got 0",
    "run --end nan": "end: Input should be a finite number, got nan",
    "run --jobs 0": "jobs: expected a number of at least 1, got 0",
    "run --agent timming": "unknown agent 'timming'; did you mean 'timing'?",
    "run --agent policy:nowhere.npz": "policy 'nowhere.npz': No such file or directory",
    "run --ego constnat": "unknown ego 'constnat'; did you mean 'constant'?",
    "run --assert colision": "unknown assertion 'colision'; did you mean 'collision'?",
    "run --assert ttcc": "unknown assertion 'ttcc'; did you mean 'ttc'?",
    "run --formula a=gap_mm>0": "unknown signal 'gap_mm'; did you mean 'gap_m'?",
    "run --param ami=1": "agent timing: unknown parameter 'ami'; did you mean 'aim'?",
    "run --agent a=timing --param a.ami=1": "unknown parameter 'a.ami'; did you mean 'a.aim'?",
    "run --agent policy:text.txt --param aim=1": "agent policy:text.txt: unknown parameter 'aim'",
    "run --ego-param tua=1": "unknown attribute of a SUMO vType 'tua'; did you mean 'tau'?",
    "run --ego time-gap --ego-param gap_s=1": "ego time-gap: unknown parameter 'gap_s'; did you",
    "run --assert-param clear=1": "reaction-zone: unknown parameter 'clear'; did you mean",
    "run --formula a=gap_m>0 --assert-param mst=1": "assertion a: unknown parameter 'mst'",
    "run --reference humn": "unknown reference driver 'humn'; did you mean 'human'?",
    "run --kind cat": "unknown kind of body 'cat'; did you mean 'car'?",
    "run --signal gren": "signal: unknown value 'gren'; did you mean 'green'?",
    "run --net crosing": "unknown network 'crosing'; did you mean 'crossing'?",
    "run --net nowhere.net.xml": "no such file; '.' holds town.net.xml",
    "run --net text.txt": "not well-formed XML",
    "run --net town.osm.gz": "cavsumo import-osm town.osm.gz -o town.net.xml",
    "run --net nowhere.sumocfg": "'nowhere.sumocfg': No such file or directory",
    "run --routes nowhere.rou.xml": "no such file: 'nowhere.rou.xml'",
    "run --additional-files nowhere.xml": "no such file: 'nowhere.xml'",
    "run --config nowhere.toml": "config 'nowhere.toml': cannot be read: No such file or directory",
    "run --config key.toml": "unknown key 'runns'; did you mean 'runs'?",
    "run --output nowhere/results.csv": "no such folder 'nowhere'",
    "run --output old.csv --resume --testers 0": "testers: Input should be greater than",
    "certify old.csv 0 --runs 0": "--runs: expected at least 1, got 0",
    "certify old.csv 0 --egos sumo,constnat": "unknown ego 'constnat'; did you mean 'constant'?",
    "certify old.csv timing --ego-param tua=1": "vType 'tua'; did you mean 'tau'?",
    "certify old.csv timming": "'timming'; did you mean 'timing'?",
    "certify nowhere.csv 0": "manifest 'nowhere.json': cannot be read",
    "replay old.csv": "which run of 'old.csv'?",
    "replay nowhere.csv 0": "manifest 'nowhere.json': cannot be read",
    "replay nowhere.jsonl.gz": "trace 'nowhere.jsonl.gz': cannot be read: No such file",
    "replay nowhere.jsonl": "trace 'nowhere.jsonl': cannot be read: No such file",
    "replay old.csv 0 --html nowhere/a.html": "no such folder 'nowhere'",
    "report nowhere.csv": "manifest 'nowhere.json': cannot be read",
    "report old.csv --replays -1": "--replays: expected at least 0, got -1",
    "minimise old.csv 0 --replys 3": "unknown option '--replys'; did you mean '--replays'?",
    "minimise old.csv": "which run of 'old.csv'?",
    "minimise old.csv 0 --replays 0": "--replays: expected at least 1, got 0",
    "minimise old.csv 0 -o a.zip": "'a.zip': expected a name that ends in .cavtest",
    "keep nowhere.cavtest -o a.cavtest": "no such file: 'nowhere.cavtest'",
    "replay nowhere.cavtest": "test 'nowhere.cavtest': cannot be read: No such file",
    "export old.csv 0 --to openscenario -o no/where": "--output 'no/where': no such folder",
    "export old.csv 0 --to opendrive -o .": "invalid choice: 'opendrive'",
    "export old.csv 0 --to commonroad --as tests -o .": "invalid choice: 'tests'",
    "import nowhere.xosc -o a.jsonl.gz": "import: no such file: 'nowhere.xosc'",
    "import old.csv -o a.csv": "'a.csv': expected a name that ends in .jsonl.gz",
    "regress old.csv --ego sumo": "'old.csv': expected a name that ends in .cavtest",
    "regress nowhere.cavtest --ego sumo": "no such file: 'nowhere.cavtest'",
    "regress nowhere.cavtest --ego constnat": "unknown ego 'constnat'; did you mean 'constant'?",
    "merge nowhere.csv -o whole.csv": "manifest 'nowhere.json': cannot be read",
    "suite euroncap-2025": "unknown suite 'euroncap-2025'; did you mean 'euroncap-2026'?",
    "suite euroncap-2026 --only CPNX": "unknown test 'CPNX'; did you mean 'CPNA'?",
    "suite euroncap-2026 --only CBLA --speeds 10": "no case is left by the filters",
    "suite euroncap-2026 --ego constnat": "unknown ego 'constnat'; did you mean 'constant'?",
    "suite nowhere.toml": "suite 'nowhere.toml': no such file",
    "suite list nowhere": "unknown suite 'nowhere'",
    "check-ego constnat --net crossing": "unknown ego 'constnat'; did you mean 'constant'?",
    "check-ego time-gap --net crossing --ego-param gap_s=1": "unknown parameter 'gap_s'",
    "check-ego sumo --net crossing --step-length 0": "step_length: Input should be greater",
    "inspect crosing": "unknown network 'crosing'; did you mean 'crossing'?",
    "inspect crossing --top 0": "--top: expected at least 1, got 0",
    "import-osm nowhere.osm -o town.xml": "expected a name that ends in .net.xml",
    "game solve nowhere.json": "game 'nowhere.json': No such file or directory",
    "game solve old.json --precision 0": "--precision: expected a positive number, got 0",
    "agents timming": "unknown agent 'timming'; did you mean 'timing'?",
    "egos constnat": "unknown ego 'constnat'; did you mean 'constant'?",
    "assertions colision": "unknown assertion 'colision'; did you mean 'collision'?",
}


@pytest.fixture(scope="module")
def answers(
    tmp_path_factory: pytest.TempPathFactory, networks: Mapping[str, Path]
) -> dict[str, tuple[int, str, set[str]]]:
    """The exit status of each refused command, what it said, and the packages loaded by then."""
    folder = tmp_path_factory.mktemp("refused")
    plan = {"scenario": {"net": "crossing"}}
    manifest = {"format": FORMAT, "status": "finished", "plan": plan}
    files = {
        "town.net.xml": networks["pedestrians"].read_text(encoding="utf-8"),
        "text.txt": "hello",
        "key.toml": 'net = "town.net.xml"\nrunns = 3\n',
        "old.csv": ",".join(COLUMNS) + "\n",
        "old.json": json.dumps(manifest),
    }
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    found = in_one_process([words.split() for words in REFUSED], folder)
    assert {file.name for file in folder.iterdir()} == files.keys()
    return dict(zip(REFUSED, found, strict=True))


def in_one_process(commands: list[list[str]], folder: Path) -> list[tuple[int, str, set[str]]]:
    """Commands one after another."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        input=json.dumps(commands),
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )
    found: list[list[Any]] = json.loads(done.stdout)
    return [(status, said, set(loaded)) for status, said, loaded in found]


@pytest.mark.parametrize("words", REFUSED)
def test_a_refused_command_imports_nothing_heavy(
    answers: Mapping[str, tuple[int, str, set[str]]], words: str
) -> None:
    """One sentence that names the nearest valid name or what is missing, exit status 2."""
    status, said, loaded = answers[words]
    assert status == 2
    assert said.startswith("cavsumo: ")
    assert said.count("\n") == 1
    assert REFUSED[words] in said
    assert not loaded.intersection(HEAVY)


def test_the_help_does_without_the_scenario_record(tmp_path: Path) -> None:
    """Only the commands that take settings import it; nothing heavy is needed for any help."""
    whole, listed, run = in_one_process(
        [["--help"], ["report", "--help"], ["run", "--help"]], tmp_path
    )
    assert [status for status, _, _ in (whole, listed, run)] == [0, 0, 0]
    assert "pydantic" not in whole[2] | listed[2]
    assert not run[2].intersection(HEAVY)


def test_a_command_that_is_carried_out_is_seen_to_import(tmp_path: Path) -> None:
    """What the tests above look for is there when a command needs it."""
    ((status, _, loaded),) = in_one_process([["inspect", "crossing"]], tmp_path)
    assert status == 0
    assert loaded >= {"numpy", "shapely", "sumolib"}
