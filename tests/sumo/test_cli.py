"""The command line: what it prints, writes and returns."""

from __future__ import annotations

import csv
import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from inline import Done, cavsumo

from cavsumo.results.columns import COLUMNS
from cavsumo.results.failures import failure_kind, preventable_first
from cavsumo.results.reading import read_rows

CONTROLLERS = """
class Broken:
    def act(self, snapshot):
        raise RuntimeError("out of petrol")
"""


@pytest.fixture(scope="module")
def town(tmp_path_factory: pytest.TempPathFactory, networks: Mapping[str, Path]) -> Path:
    """A folder with the straight road as town.net.xml, and with all sorts of broken files."""
    folder = tmp_path_factory.mktemp("town")
    road = networks["pedestrians"].read_text(encoding="utf-8")
    files = {
        "town.net.xml": road,
        "bare.net.xml": road.replace('allow="pedestrian"', 'allow="bicycle"'),
        "text.net.xml": "hello\n",
        "cut.rou.xml": '<routes>\n<vehicle id="a"\n',
        "foreign.rou.xml": '<routes><vehicle id="a" depart="0" route="nowhere"/></routes>\n',
        "broken.toml": 'net = "town.net.xml"\nruns = = 3\n',
        "key.toml": 'net = "town.net.xml"\nrunns = 3\n',
        "aimless.toml": 'net = "town.net.xml"\nruns = 1\nassertions = []\n',
        "controllers.py": CONTROLLERS,
    }
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "folder.net.xml").mkdir()
    (folder / "taken").mkdir()
    return folder


def listing(folder: Path) -> list[str]:
    """Every file in a folder and below, but for what Python itself leaves behind."""
    return sorted(str(f.relative_to(folder)) for f in folder.rglob("*") if "pyc" not in str(f))


# What works ---------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def failing(town: Path) -> dict[str, Done]:
    """An ego that brakes for nobody, twice the same batch: plainly, and as a study."""
    words = "run -n town.net.xml -r none --ego constant --runs 4 --seed 3 --trace tests".split()
    return {
        "plain": cavsumo(town, *words, "-o", "plain.csv"),
        "study": cavsumo(town, *words, "-o", "study.csv", "--exit-zero", "-q"),
    }


def test_an_ego_that_fails_is_exit_status_1(town: Path, failing: Mapping[str, Done]) -> None:
    """A script sees the failure, a reader the first one with the command that replays it."""
    assert failing["plain"].returncode == 1
    failures = preventable_first(read_rows(town / "plain.csv"))
    first = f"first {failure_kind(failures[0])} failure: run {failures[0]['run']} (timing): coll"
    assert first in failing["plain"].stdout
    assert "exit status 1: the ego violated an assertion, preventably in" in failing["plain"].stderr
    assert f"cavsumo replay plain.csv {failures[0]['run']}" in failing["plain"].stdout
    assert (town / failures[0]["trace"]).is_file()


def test_a_study_is_content_and_quiet(
    failing: Mapping[str, Done],
) -> None:
    """Where finding failures is the aim, exit status 0; quiet means not a word."""
    study = failing["study"]
    assert (study.returncode, study.stdout, study.stderr) == (0, "", "")


def test_the_same_command_finds_the_same(town: Path, failing: Mapping[str, Done]) -> None:
    """Two batches of one seed are equal to the last digit but for the real time they took."""
    assert failing
    batches = [read_rows(town / f"{name}.csv") for name in ("plain", "study")]
    for row in batches[0] + batches[1]:
        assert row.pop("wall_s")
        row["trace"] = row["trace"].replace("plain/", "").replace("study/", "")
    assert batches[0] == batches[1]


def test_a_controller_that_raises_is_exit_status_3(town: Path) -> None:
    """Each episode says what the controller did wrong; the batch goes on and ends with 3."""
    words = "run -n town.net.xml -r none --runs 2 --ego controllers:Broken -o broken.csv"
    done = cavsumo(town, *words.split())
    assert done.returncode == 3
    rows = read_rows(town / "broken.csv")
    assert [row["outcome"] for row in rows] == ["error", "error"]
    assert all("RuntimeError: out of petrol" in row["error"] for row in rows)
    assert "Traceback" not in done.stderr
    assert "2 could not be run; run 0: " in done.stdout


def test_agents_take_turns_as_the_file_says_and_the_command_line_overrules(town: Path) -> None:
    """The file names agents and horizon, the command line the number of episodes of today.

    Each agent meets the same starts, and has its line in the summary.
    """
    text = (
        'net = "town.net.xml"\nroutes = "none"\nagents = ["noop", "random"]\nruns = 50\nend = 2\n'
    )
    (town / "plan.toml").write_text(text, encoding="utf-8")
    done = cavsumo(town, "run", "-c", "plan.toml", "--runs", "2", "-o", "plan.csv", "--exit-zero")
    assert done.returncode == 0
    rows = read_rows(town / "plan.csv")
    assert [row["agent"] for row in rows] == ["noop", "random"] * 2
    assert {row["time_s"] for row in rows} == {"2.000"}
    assert rows[0]["seed"] == rows[1]["seed"] != rows[2]["seed"]
    assert [line.split()[0] for line in done.stdout.splitlines()[1:3]] == ["noop", "random"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("agents", ["noop", "random", "proximity", "timing", "election", "q-learning"]),
        (
            "egos",
            [
                "sumo",
                "sumo:IDM",
                "constant",
                "time-gap",
                "module:Class",
                "exec:COMMAND",
                "tcp:HOST",
            ],
        ),
        ("assertions", ["reaction-zone", "collision"]),
        ("agents proximity", ["distance_m=34.0", "[m]"]),
        ("egos exec", ["exec: A program", "reply_s=1.0", "length=4.5", "[s]"]),
        ("egos sumo", ["carFollowModel=Krauss", "reaction_s=", "[s]"]),
        ("assertions reaction-zone", ["reaction_time=0.675", "[m/s2]"]),
        ("run --help", ["--net", "--agent", "--runs", "--output"]),
        ("--version", ["cavsumo 0."]),
    ],
)
def test_listings(town: Path, words: str, said: list[str]) -> None:
    """What there is to choose from, with defaults and units, on stdout."""
    done = cavsumo(town, *words.split())
    assert (done.returncode, done.stderr) == (0, "")
    for word in said:
        assert word in done.stdout


def test_the_weights_of_one_batch_begin_the_next(town: Path) -> None:
    """A learner goes on with what an earlier batch wrote, as its parameter promises."""
    words = "run -n town.net.xml -r none --agent q-learning --runs 1 -e 3 --exit-zero -q".split()
    assert cavsumo(town, *words, "-o", "school.csv").returncode == 0
    learned: Any = json.loads((town / "school.json").read_text(encoding="utf-8"))["learned"]
    assert learned["q-learning"]
    again = cavsumo(town, *words, "--param", "weights=school.json", "-o", "later.csv")
    assert (again.returncode, again.stderr) == (0, "")


# What is refused ----------------------------------------------------------------------------------

ROAD = "run -n town.net.xml"
REFUSED = [
    ("game", "arguments are required"),
    ("run -n nowhere.net.xml", "no such file; '.' holds bare.net.xml"),
    ("run -n text.net.xml", "not well-formed XML"),
    ("run -n folder.net.xml", "folder.net.xml"),
    ("run -n bare.net.xml", "no pavements"),
    (f"{ROAD} --agent timming", "did you mean 'timing'?"),
    (f"{ROAD} --ego constnat", "did you mean 'constant'?"),
    (f"{ROAD} --param ain=0.5", "did you mean 'aim'?"),
    (f"{ROAD} --param aim", "expected KEY=VALUE, got 'aim'"),
    (f"{ROAD} --kind car --agent q-learning", "can only walk"),
    (f"{ROAD} --testers 0", "testers"),
    (f"{ROAD} --runs 0", "runs"),
    (f"{ROAD} --end nan", "end"),
    (f"{ROAD} --end -1", "end"),
    (f"{ROAD} --step-length 0.00015", "step_length"),
    (f"{ROAD} --ego-route eastbond", "did you mean 'eastbound'?"),
    (f"{ROAD} --ego-route eastbound,westbound", "no car can follow"),
    (f"{ROAD} --junction nowhere", "unknown junction 'nowhere'"),
    (f"{ROAD} -r nowhere.rou.xml", "no such file: 'nowhere.rou.xml'"),
    (f"{ROAD} -r foreign.rou.xml", "nowhere"),
    pytest.param(
        f"{ROAD} -r cut.rou.xml",
        "cut.rou.xml",
    ),
    ("run -c nowhere.toml", "nowhere.toml"),
    ("run -c broken.toml", "line 2"),
    ("run -c key.toml", "did you mean 'runs'?"),
    pytest.param(
        "run -c aimless.toml",
        "assertions",
    ),
    (f"{ROAD} -o nowhere/results.csv", "no such folder 'nowhere'"),
    pytest.param(
        f"{ROAD} -o taken",
        "taken",
    ),
    (f"{ROAD} --trase all", "--trase"),
    ("agents timming", "did you mean 'timing'?"),
]


@pytest.mark.parametrize(("words", "said"), REFUSED)
def test_bad_input_is_one_sentence(town: Path, words: str, said: str) -> None:
    """One line on stderr that says what is wrong, exit status 2, and nothing written."""
    before = listing(town)
    quiet = ["-q"] if words.startswith("run ") else []
    done = cavsumo(town, *words.split(), *quiet)
    after = listing(town)
    for name in set(after) - set(before):
        shutil.rmtree(town / name) if (town / name).is_dir() else (town / name).unlink()
    assert done.returncode == 2
    assert done.stderr.startswith("cavsumo: ")
    assert len(done.stderr.splitlines()) == 1, done.stderr
    assert said in done.stderr
    assert done.stdout == ""
    assert after == before


def test_the_header_is_the_interface(town: Path, failing: Mapping[str, Done]) -> None:
    """Columns are written in the order of the documented table, one value for each."""
    assert failing
    with (town / "plain.csv").open(encoding="utf-8", newline="") as stream:
        header, *rows = csv.reader(stream)
    assert header == list(COLUMNS)
    assert all(len(row) == len(header) for row in rows)
